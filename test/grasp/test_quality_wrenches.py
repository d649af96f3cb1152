# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from quality_cases import CENTRE, OCTAHEDRON, PINCH, on_ball, scattered

from ccr_ros.grasp.quality import FrictionContact, wrench_in_words
from ccr_ros.grasp.quality.wrenches import contact_wrenches
from ccr_ros.model import InvalidValue


def test_a_contact_pushes_on_the_object_against_its_normal():
    contact = FrictionContact([0.0, 0.2, 0.0], [0.0, 0.0, 1.0], 0.5)
    wrenches = contact_wrenches([contact], np.array([0.0, 0.1, 0.0]), 0.1)
    assert np.allclose(wrenches.normal, [[0, 0, -1, -1, 0, 0]])  # moment: arm x force / length
    for wrench in wrenches.tangent[0].T:
        assert np.linalg.norm(wrench[:3]) == pytest.approx(0.5)
        assert wrench[2] == pytest.approx(0)
        assert np.allclose(wrench[3:], np.cross([0, 1.0, 0], wrench[:3]))


def test_the_reach_is_that_of_the_round_cone():
    rng = np.random.default_rng(1)
    wrenches = contact_wrenches(scattered(rng, 4, 0.7), CENTRE, 0.8)
    directions = rng.standard_normal((5, 6))
    reach, points = wrenches.reach(directions)
    fine = wrenches.edges(3600)
    assert np.allclose(reach, np.einsum("nej,kj->kne", fine, directions).max(axis=2), atol=1e-4)
    assert np.allclose(reach, np.einsum("knj,kj->kn", points, directions))
    inside = (points - wrenches.normal)[..., :3]
    assert np.allclose(np.linalg.norm(inside, axis=2), 0.7)


def test_by_default_moments_are_divided_by_the_largest_arm():
    contacts = on_ball(3 * OCTAHEDRON, 0.5)
    assert contact_wrenches(contacts, CENTRE).length == pytest.approx(3)
    assert contact_wrenches([], CENTRE).length == 1


def test_what_no_contact_can_do_is_found():
    assert contact_wrenches(on_ball(OCTAHEDRON, 0.5), CENTRE).missing() is None
    pinch = contact_wrenches(on_ball(PINCH, 0.5), CENTRE).missing()
    assert np.allclose(np.abs(pinch), [0, 0, 0, 1, 0, 0])
    slippery = contact_wrenches(on_ball(OCTAHEDRON, 0.0), CENTRE).missing()
    assert np.allclose(slippery[:3], 0)
    assert contact_wrenches([], CENTRE).missing() is not None


@pytest.mark.parametrize(
    ("wrench", "words"),
    [
        ([0, 0, -2, 0, 0, 0], "a force along -z"),
        ([0, 0, 0, 0.3, 0.01, 0], "a moment about x"),
        ([1, 1, 0, 0, 0, 0], "a force along (0.71, 0.71, 0.00)"),
        ([0, 1, 0, 0, -1, 0], "a force along y with a moment about -y"),
    ],
)
def test_wrenches_in_words(wrench, words):
    assert wrench_in_words(np.array(wrench, float)) == words


def test_bad_values_are_named():
    contacts = on_ball(PINCH, 0.5)
    with pytest.raises(InvalidValue, match="centre"):
        contact_wrenches(contacts, [0, np.nan, 0])
    for length in (0.0, -1.0, np.inf, np.nan):
        with pytest.raises(InvalidValue, match="length"):
            contact_wrenches(contacts, CENTRE, length)
    with pytest.raises(InvalidValue, match="length"):
        contact_wrenches([FrictionContact(CENTRE, [1, 0, 0], 0.5)], CENTRE)
