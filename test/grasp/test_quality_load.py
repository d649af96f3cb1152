# SPDX-License-Identifier: Apache-2.0
import sys

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from quality_cases import CENTRE, EQUATOR, PINCH, moved, on_ball, scattered

from ccr_ros.grasp.quality import FrictionContact, force_closure, largest_load
from ccr_ros.model import InvalidValue, Pose
from ccr_ros.model.errors import MissingPackage

SEEDS = st.integers(0, 2**32 - 1)
FEW = settings(max_examples=10, suppress_health_check=[HealthCheck.too_slow])
DOWN = np.array([0, 0, -1.0])


def block(angle, friction, limit=np.inf):
    """A block's four feet, 0.2 m apart along the incline and across, its centre between them."""
    along = np.array([np.cos(angle), 0, -np.sin(angle)])
    up = np.array([np.sin(angle), 0, np.cos(angle)])
    return [
        FrictionContact(0.1 * (a * along + np.array([0, b, 0])), -up, friction, limit=limit)
        for a in (-1, 1)
        for b in (-1, 1)
    ]


@pytest.mark.parametrize("friction", [0.1, 0.5, 1.2])
def test_a_block_on_an_incline_slips_where_the_tangent_is_the_friction(friction):
    slips_at = np.arctan(friction)
    assert largest_load(block(slips_at - 1e-5, friction), CENTRE, DOWN).lower == np.inf
    slipping = largest_load(block(slips_at + 1e-5, friction), CENTRE, DOWN)
    assert slipping.lower == slipping.upper == 0


def test_feet_that_carry_two_newtons_each_carry_a_block_of_eight_on_an_incline():
    found = largest_load(block(0.3, 0.5, limit=2.0), CENTRE, DOWN)
    assert found.lower == pytest.approx(8 / np.cos(0.3), rel=1e-5)


@pytest.mark.parametrize("direction", [0.0, 0.3, 1.0, 2.5])
def test_a_pinch_carries_twice_friction_times_grip_any_way_across(direction):
    contacts = on_ball(PINCH, 0.5, limit=3.0)
    across = np.array([0, np.sin(direction), -np.cos(direction)])
    found = largest_load(contacts, CENTRE, across)
    assert found.lower == pytest.approx(2 * 0.5 * 3.0, rel=1e-5)
    assert found.upper == pytest.approx(found.lower, rel=1e-5)
    assert largest_load(contacts, CENTRE, np.zeros(3), [1, 0, 0]).upper == 0
    # along the line the other finger lets go: grip of one, no more
    assert largest_load(contacts, CENTRE, [1, 0, 0]).lower == pytest.approx(3.0, rel=1e-5)


def test_three_contacts_on_the_equator_of_a_ball():
    contacts = on_ball(0.05 * EQUATOR, 0.5, limit=2.0)
    assert largest_load(contacts, CENTRE, DOWN).lower == pytest.approx(3 * 0.5 * 2, rel=1e-5)
    turn = largest_load(contacts, CENTRE, np.zeros(3), [0, 0, 1])
    assert turn.lower == pytest.approx(3 * 0.5 * 2 * 0.05, rel=1e-5)


@FEW
@given(SEEDS, st.integers(2, 6), st.floats(0.0, 1.2))
def test_the_forces_that_prove_it_balance_and_keep_to_cones_and_limits(seed, count, friction):
    rng = np.random.default_rng(seed)
    contacts = [
        FrictionContact(c.position, c.normal, friction, limit=float(rng.uniform(0, 5)))
        for c in scattered(rng, count, friction)
    ]
    force, moment = rng.standard_normal((2, 3))
    found = largest_load(contacts, CENTRE, force, moment)
    assert 0 <= found.lower <= found.upper < np.inf
    assert found.upper - found.lower <= 1e-5 * found.upper + 1e-7
    total, turn = found.lower * force, found.lower * moment
    for contact, push in zip(contacts, found.forces, strict=True):
        total, turn = total + push, turn + np.cross(contact.position, push)
        pressed = -push @ contact.normal
        across = np.linalg.norm(push + pressed * contact.normal)
        assert -1e-6 <= pressed <= contact.limit + 1e-6
        assert across <= friction * pressed + 1e-6
    assert np.allclose(total, 0, atol=1e-5) and np.allclose(turn, 0, atol=1e-5)


@FEW
@given(SEEDS)
def test_more_friction_or_grip_never_carries_less(seed):
    def payload(friction, limit):
        contacts = scattered(np.random.default_rng(seed), 4, friction)
        contacts = [FrictionContact(c.position, c.normal, friction, limit=limit) for c in contacts]
        return largest_load(contacts, CENTRE, DOWN).lower

    one = payload(0.4, 1.0)
    assert payload(0.7, 1.0) >= one * (1 - 1e-5) - 1e-9
    assert payload(0.4, 2.0) == pytest.approx(2 * one, rel=1e-4, abs=1e-7)


@FEW
@given(SEEDS, st.integers(3, 6))
def test_with_force_closure_and_no_limits_any_load_is_carried(seed, count):
    rng = np.random.default_rng(seed)
    contacts = scattered(rng, count, 0.8)
    wrench = rng.standard_normal((2, 3))
    if force_closure(contacts, CENTRE).closed:
        assert largest_load(contacts, CENTRE, *wrench).lower == np.inf
    else:
        weakest = force_closure(contacts, CENTRE, length=1.0).weakest
        assert largest_load(contacts, CENTRE, weakest[:3], weakest[3:]).lower < 1e-6


@FEW
@given(SEEDS)
def test_a_rigid_motion_changes_nothing(seed):
    rng = np.random.default_rng(seed)
    contacts = [
        FrictionContact(c.position, c.normal, c.friction, limit=1.0) for c in scattered(rng, 4, 0.6)
    ]
    turn = rng.standard_normal(4)
    pose = Pose(rng.standard_normal(3), turn / np.linalg.norm(turn))
    one = largest_load(contacts, CENTRE, DOWN)
    two = largest_load(moved(contacts, pose), pose.position, pose.vectors(DOWN))
    assert two.lower == pytest.approx(one.lower, rel=1e-4, abs=1e-7)


def test_limits_of_nothing_and_no_contacts_carry_nothing():
    assert largest_load(on_ball(EQUATOR, 0.5, limit=0.0), CENTRE, DOWN).upper == 0
    assert largest_load([], CENTRE, DOWN).upper == 0


def test_one_contact_at_the_centre_carries_what_its_cone_holds():
    below = [FrictionContact(CENTRE, DOWN, 0.5, limit=4.0)]
    assert largest_load(below, CENTRE, DOWN).lower == pytest.approx(4)
    assert largest_load(below, CENTRE, -DOWN).upper == 0


def test_bad_values_are_named():
    contacts = on_ball(EQUATOR, 0.5)
    for args, named in (
        (([0, 0, 0],), "force"),
        (([0, 0, np.nan],), "force"),
        ((DOWN, [0, np.inf, 0]), "moment"),
        ((DOWN, [0, 0]), "moment"),
        ((DOWN, None, 0.0), "tolerance"),
    ):
        with pytest.raises(InvalidValue, match=named):
            largest_load(contacts, CENTRE, *args)
    for bad in ([0, 0], None, "here", [0, 0, np.nan]):
        with pytest.raises(InvalidValue, match="centre"):
            largest_load(contacts, bad, DOWN)


def test_without_scipy_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "scipy.optimize", None)
    with pytest.raises(MissingPackage, match="quality"):
        largest_load(on_ball(EQUATOR, 0.5), CENTRE, DOWN)
