# SPDX-License-Identifier: Apache-2.0
"""Mirrored fingers, holes as numbers, and bases that put a free finger's tip where it shall be."""

from dataclasses import replace

import numpy as np
import pytest

from ccr_ros.design.turn_units import (
    Unit,
    UnitChoice,
    holes_of,
    kinds_of,
    made_finger,
    made_gripper,
    placed,
    touch,
    units_of,
)
from ccr_ros.grasp.statics import box_body
from ccr_ros.model import (
    Cable,
    FingerSolver,
    InvalidValue,
    NotConverged,
    Pose,
    Sphere,
    load_gripper,
)
from ccr_ros.resources import find_config

AT = Pose(np.array([0.0, 0.0, 0.17]))
CUBE = box_body(np.full(3, 0.04)).shape


@pytest.fixture(scope="module")
def gripper():
    return load_gripper(find_config("gripper_cube"))


def test_the_cube_gripper_is_a_thumb_and_a_mirrored_pair(gripper):
    assert units_of(gripper) == (Unit(0), Unit(1, 2))
    straight = load_gripper(find_config("gripper_cube_straight"))
    assert units_of(straight) == units_of(gripper)
    assert kinds_of(gripper) == [0, 1, 2] and kinds_of(straight) == [0, 1, 1]


def test_fingers_that_differ_are_no_pair(gripper):
    first, second, third = gripper.fingers
    stiff = replace(third, finger=replace(third.finger, youngs_modulus=3e9))
    assert units_of(replace(gripper, fingers=(first, second, stiff))) == (Unit(0), Unit(1), Unit(2))
    moved = replace(
        third, base=Pose(third.base.position + np.array([1e-3, 0, 0]), third.base.orientation)
    )
    assert len(units_of(replace(gripper, fingers=(first, second, moved)))) == 3


def test_holes_are_counted_without_jumps_and_make_the_finger_again(gripper):
    for mounted in gripper.fingers:
        holes = holes_of(mounted.finger)
        again = made_finger(mounted.finger, holes)
        for cable, new in zip(mounted.finger.cables, again.cables, strict=True):
            turns = (new.angles - cable.angles) / (2 * np.pi)
            np.testing.assert_allclose(turns, np.round(turns), atol=1e-12)
    winding = made_finger(gripper.fingers[1].finger, ((10, 11, 12, 13, 14, 15, 16, 17, 18, 19),))
    (path,) = holes_of(winding)
    assert set(np.diff(path)) == {1} and (path[0] - 10) % 12 == 0


def test_angles_beside_holes_are_refused(gripper):
    finger = gripper.fingers[1].finger
    bad = replace(finger, cables=(Cable("main", np.full(10, 0.1)),))
    with pytest.raises(InvalidValue, match=r"cube_finger|finger_2.*main"):
        holes_of(bad)


def test_a_placed_finger_touches_at_its_spot(gripper):
    for mounted, spot in zip(gripper.fingers, (0.002, 0.011, -0.004), strict=True):
        base = placed(mounted, CUBE, AT, spot)
        local = base.inverse() @ AT
        point = touch(mounted.finger, CUBE, local)
        assert point[1] - local.position[1] == pytest.approx(spot, abs=1e-5)
        assert abs(CUBE.signed_distance((point - local.position)[None] @ local.rotation)[0]) < 1e-4
        assert base.position[[0, 2]] == pytest.approx(mounted.base.position[[0, 2]])


def test_the_point_is_the_one_that_the_contact_solver_finds(gripper):
    mounted = gripper.fingers[1]
    local = mounted.base.inverse() @ AT
    point = touch(mounted.finger, CUBE, local)
    solver = FingerSolver(replace(mounted.finger, obstacles=(CUBE.moved(local),)))
    pull, contacts = 0.0, ()
    while not contacts:
        pull += 5e-5
        contacts = solver.solve([pull]).contacts
    assert contacts[0].disk == 9
    np.testing.assert_allclose(contacts[0].position, point, atol=3e-4)


def test_round_objects_are_met_at_the_spot_too(gripper):
    ball = Sphere(np.zeros(3), 0.02, name="ball")
    base = placed(gripper.fingers[1], ball, AT, 0.005)
    local = base.inverse() @ AT
    point = touch(gripper.fingers[1].finger, ball, local)
    assert point[1] - local.position[1] == pytest.approx(0.005, abs=1e-4)


def test_what_cannot_be_reached_is_told(gripper):
    with pytest.raises(NotConverged, match="does not come to the object"):
        touch(gripper.fingers[1].finger, CUBE, Pose(np.array([0.0, 0.4, 0.1])))


def test_a_made_gripper_keeps_mirrored_fingers_mirrored(gripper):
    units = units_of(gripper)
    straight = tuple((n,) * 10 for n in (2, -2))
    wound = ((2, 2, 2, 1, 1, 1, 0, 0, 0, 0),)
    choices = [UnitChoice(straight, 0.005, 0.0), UnitChoice(wound, -0.01, 0.012)]
    made = made_gripper(gripper, units, choices, CUBE, AT)
    assert made.name == gripper.name and made.finger_names == gripper.finger_names
    assert units_of(made) == units
    assert made.fingers[0].base.position[0] == pytest.approx(0.060)
    assert made.fingers[1].base.position[0] == pytest.approx(-0.045)
    local = made.fingers[2].base.inverse() @ AT
    other = touch(made.fingers[2].finger, CUBE, local)
    assert other[1] - local.position[1] == pytest.approx(-0.012, abs=2e-5)
