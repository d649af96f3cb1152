# SPDX-License-Identifier: Apache-2.0
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from quality_cases import CENTRE, EQUATOR, OCTAHEDRON, PINCH, fixture, moved, on_ball, scattered

from ccr_ros.grasp.quality import FrictionContact, force_closure
from ccr_ros.grasp.quality.wrenches import contact_wrenches
from ccr_ros.model import Pose
from ccr_ros.model.errors import MissingPackage

SEEDS = st.integers(0, 2**32 - 1)


def test_three_contacts_with_friction_close_on_a_ball_and_two_do_not():
    assert force_closure(on_ball(EQUATOR, 0.1), CENTRE).closed
    pinch = force_closure(on_ball(PINCH, 0.9), CENTRE)
    assert not pinch.closed
    assert np.allclose(np.abs(pinch.weakest), [0, 0, 0, 1, 0, 0])  # a turn about their line


def test_without_friction_nothing_closes_on_a_ball():
    assert not force_closure(on_ball(EQUATOR, 0.0), CENTRE).closed
    assert not force_closure(on_ball(OCTAHEDRON, 0.0), CENTRE).closed
    assert not force_closure([], CENTRE).closed


def test_without_friction_seven_contacts_close_and_no_six_of_them():
    contacts = fixture()
    assert force_closure(contacts, CENTRE).closed
    for left_out in range(7):
        six = contacts[:left_out] + contacts[left_out + 1 :]
        assert not force_closure(six, CENTRE).closed


@given(SEEDS, st.integers(1, 6))
def test_without_friction_six_contacts_or_fewer_never_close(seed, count):
    contacts = scattered(np.random.default_rng(seed), count, 0.0)
    assert not force_closure(contacts, CENTRE).closed


@pytest.mark.parametrize("lean", [0.01, 0.3, 1.0])
@pytest.mark.parametrize("roll", [0.0, 0.25, 0.5, 0.8])
def test_the_cones_are_round(lean, roll):
    """Two points balance if the line between them lies in both friction cones (Nguyen 1988).

    Two such pairs side by side close. All normals lean the same way from the line, by the tangent
    `lean`, in a direction that no edge of a linearised cone would meet.
    """
    aside = np.array([0, -np.sin(roll), np.cos(roll)])
    tilt = lean * np.array([0, np.cos(roll), np.sin(roll)])
    places = [(end, side) for end in PINCH for side in (-0.1, 0.1)]
    for factor, closed in ((1 - 1e-4, False), (1 + 1e-4, True)):
        contacts = [
            FrictionContact(end + side * aside, end + tilt, factor * lean) for end, side in places
        ]
        assert force_closure(contacts, CENTRE).closed is closed


@given(SEEDS, st.integers(2, 7), st.floats(0.05, 1.5))
def test_what_is_said_to_be_unbalanced_is(seed, count, friction):
    contacts = scattered(np.random.default_rng(seed), count, friction)
    found = force_closure(contacts, CENTRE)
    if not found.closed:  # no contact can push against the weakest wrench
        reach, _ = contact_wrenches(contacts, CENTRE).reach(-found.weakest[None])
        assert reach.max() < 1e-8


@given(SEEDS, st.integers(3, 6), st.floats(0.1, 1.0))
def test_a_rigid_motion_and_a_scale_change_nothing(seed, count, friction):
    rng = np.random.default_rng(seed)
    contacts = scattered(rng, count, friction)
    turn = rng.standard_normal(4)
    pose = Pose(rng.standard_normal(3), turn / np.linalg.norm(turn))
    one = force_closure(contacts, CENTRE)
    two = force_closure(moved(contacts, pose), pose.position, length=3.0)
    assert one.closed is two.closed


@given(SEEDS, st.integers(3, 6))
def test_more_friction_does_not_open(seed, count):
    closed = [
        force_closure(scattered(np.random.default_rng(seed), count, friction), CENTRE).closed
        for friction in (0.05, 0.2, 0.5, 1.0, 2.0)
    ]
    assert closed == sorted(closed)


def test_without_scipy_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "scipy.optimize", None)
    with pytest.raises(MissingPackage, match="quality"):
        force_closure(on_ball(EQUATOR, 0.5), CENTRE)
