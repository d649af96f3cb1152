# SPDX-License-Identifier: Apache-2.0
"""Rest shapes: the forward model, pulled from rest, reaches the wanted shape to 1e-10 mm^2."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from model.fingers import helical_cable, make_finger, straight_cable

from ccr_ros.design.press import Press
from ccr_ros.design.pull import Pull
from ccr_ros.design.rest_shape import RestShapeSolver
from ccr_ros.design.target import DesiredShape
from ccr_ros.design.verify import TOLERANCE, pull_from_rest
from ccr_ros.model import (
    Cable,
    Finger,
    FingerSolver,
    InvalidValue,
    Plane,
    Sphere,
    UnknownName,
    load_finger,
    solve,
)
from ccr_ros.model.result import disk_overlap
from ccr_ros.resources import find_config
from design.shapes import SPHERE, on_curve, wandering_shape

BALL = Sphere([0.042, 0.0, 0.110], 0.056, name="ball")


def sphere_finger(**changes: object) -> Finger:
    return replace(load_finger(find_config("sphere_finger")), **changes)


def percent(value: float, name: str = "main") -> dict[str, Pull]:
    return {name: Pull(value / 100, relative=True)}


def the_one(design):
    assert len(design.shapes) == 1 and design.refused == ()
    return design.shapes[0]


def assert_reached(found, shape, steps=4):
    path = pull_from_rest(found.finger, found.pulls, shape, steps)
    assert path.reached and path.smooth and path.squared_error <= TOLERANCE
    last = path.last
    assert last.backbone == pytest.approx(found.actuated, abs=1e-9)
    assert last.tensions == pytest.approx(found.tensions, rel=1e-6, abs=1e-9)
    assert last.energy == pytest.approx(found.energy, rel=1e-6, abs=1e-15)
    assert last.certificate.smallest_eigenvalue == pytest.approx(
        found.smallest_eigenvalue, abs=1e-5
    )
    return last


def test_the_papers_sphere_finger():
    finger = sphere_finger(obstacles=(BALL,))
    shape = on_curve(SPHERE, finger)
    found = the_one(RestShapeSolver(finger).solve(shape, percent(3)))
    assert found.pulls / found.rest_lengths == pytest.approx([0.03], abs=1e-12)
    assert found.stable and found.residual < 1e-12 and found.squared_error < 1e-24
    last = assert_reached(found, shape, steps=10)
    assert not last.contacts  # it lies on the ball, and does not press on it
    gaps = BALL.signed_distance(last.cables["main"][5:])
    assert np.abs(gaps).max() < 1e-9  # disks of radius a: the backbone runs a above the ball
    # An earlier answer, made by hand for constant curvature, was alike on the contour.
    means = np.asarray(found.finger.rest_curvature).mean(axis=1)
    assert means[6:, 1] == pytest.approx([10.661, 12.116, 11.745], abs=1.5)
    assert np.abs(means[:, [0, 2]]).max() < 1e-9


def test_it_presses_with_the_forces_that_are_asked_for():
    finger = sphere_finger(obstacles=(BALL,))
    shape = on_curve(SPHERE, finger)
    solver = RestShapeSolver(finger)
    presses = [Press(7, 0.1), Press(9, 0.05, "cable", "main")]
    found = the_one(solver.solve(shape, percent(3), presses))
    last = assert_reached(found, shape)
    assert [(c.disk, c.point, c.obstacle) for c in last.contacts] == [
        (7, "cable", "ball"),
        (9, "cable", "ball"),
    ]
    assert [c.force for c in last.contacts] == pytest.approx([0.1, 0.05], rel=1e-6)
    # Linear: equation (1) holds at any force.
    free = the_one(solver.solve(shape, percent(3)))
    assert found.tensions[0] > free.tensions[0] and found.rest_gap < free.rest_gap


def test_one_rest_shape_per_pull():
    finger = sphere_finger()
    shape = on_curve(SPHERE, finger)
    solver = RestShapeSolver(finger)
    tensions = []
    for pull in (0.5, 1, 2, 4, 8, 16):
        found = the_one(solver.solve(shape, percent(pull)))
        assert_reached(found, shape, steps=2)
        tensions.append(found.tensions[0])
    assert tensions == sorted(tensions) and tensions[0] > 0


def routings() -> dict[str, tuple[Cable, ...]]:
    rng = np.random.default_rng(11)
    return {
        "straight": (straight_cable(4),),
        "helical": (helical_cable(),),
        "general_1": (Cable.from_holes("main", [1, 12, 11, 10, 10, 10, 10, 11, 12, 1]),),
        "wild": (Cable("wild", np.cumsum(rng.normal(size=10) * 0.6)),),
        "short": (straight_cable(2, 6),),
        "two": (straight_cable(4), helical_cable()),
        "two short": (straight_cable(1, 7, "a"), straight_cable(9, 10, "b")),
        "two wild": (
            Cable("a", np.cumsum(rng.normal(size=10) * 0.4)),
            Cable("b", np.cumsum(rng.normal(size=10) * 0.4) + 2.0),
        ),
    }


@pytest.mark.parametrize("seed", range(24))
def test_random_shapes_in_space(seed):
    """Eight routings, one and two cables, curves that bend by up to 40 1/m, various pulls."""
    name, cables = list(routings().items())[seed % 8]
    finger = make_finger(*cables)
    shape = wandering_shape(finger, seed, bend=(4.0, 7.0, 10.0)[seed // 8])
    values = (2.0, 3.0, 4.0)[seed % 3], (1.0, 2.5)[seed % 2]
    pulls = {
        c.name: Pull(v / 100, relative=True) for c, v in zip(cables, values, strict=False)
    }  # fmt: skip
    design = RestShapeSolver(finger).solve(shape, pulls)
    assert design.fit.squared_error < 1e-26 and design.fit.angle_error < 1e-9
    assert design.shapes, (name, design.refused)
    found = design.shapes[0]
    assert found.residual < 1e-11 and found.stable
    wanted = [v / 100 for _, v in zip(cables, values, strict=False)]
    assert found.pulls / found.rest_lengths == pytest.approx(wanted, abs=1e-11)
    assert_reached(found, shape)


def test_frames_are_met_as_well():
    """The pose of a twisted, helically pulled finger comes back from its disks' frames."""
    finger = make_finger(helical_cable(), rest_curvature=np.tile([2.0, 4.0, 3.0], (9, 1)))
    pose = solve(finger, [0.006])
    shape = DesiredShape.of(pose)
    found = the_one(RestShapeSolver(finger).solve(shape, {"helical": Pull(0.006)}))
    last = assert_reached(found, shape)
    assert last.frames == pytest.approx(pose.frames, abs=1e-8)
    assert found.tensions == pytest.approx(pose.tensions, rel=2e-3)
    centres = DesiredShape.of(pose, frames=False)
    untwisted = the_one(RestShapeSolver(finger).solve(centres, {"helical": Pull(0.006)}))
    assert np.abs(assert_reached(untwisted, centres).frames - pose.frames).max() > 0.05


def test_the_rest_shape_of_the_file_does_not_matter():
    shape = on_curve("arc:80", make_finger())
    bent = make_finger(rest_curvature=np.tile([0.0, 9.0, 1.0], (9, 1)))
    one, two = (
        the_one(RestShapeSolver(f).solve(shape, percent(2, "helical")))
        for f in (make_finger(), bent)
    )
    assert np.array_equal(one.finger.rest_curvature, two.finger.rest_curvature)


def test_forces_scale_with_the_modulus_and_shapes_do_not():
    shape = on_curve("s:70", make_finger())
    soft, steel = (
        the_one(RestShapeSolver(f).solve(shape, percent(2, "helical")))
        for f in (make_finger(), make_finger(youngs_modulus=2e11))
    )
    stiffness = steel.finger.bending_stiffness
    assert steel.tensions == pytest.approx(soft.tensions * stiffness)
    assert steel.energy == pytest.approx(soft.energy * stiffness)
    assert np.array_equal(steel.finger.rest_curvature, soft.finger.rest_curvature)


@pytest.mark.parametrize("segments", [3, 15, 30])
def test_other_numbers_of_segments(segments):
    finger = make_finger(straight_cable(4, segments + 1), segments=segments)
    shape = wandering_shape(finger, 3, bend=5.0)
    found = RestShapeSolver(finger).solve(shape, percent(3, "straight")).shapes[0]
    assert found.stable
    assert_reached(found, shape, steps=2)


def test_several_rest_shapes_for_one_pull_are_listed_least_tension_first():
    """With long segments a second rest shape, curled the other way, has the same cable length."""
    finger = make_finger(straight_cable(4, 4), segments=3)
    shape = wandering_shape(finger, 3, bend=5.0)
    found = RestShapeSolver(finger).solve(shape, percent(3, "straight")).shapes
    assert len(found) == 2 and found[0].tensions[0] < found[1].tensions[0]
    for item in found:
        assert item.residual < 1e-11
        assert item.pulls / item.rest_lengths == pytest.approx([0.03], abs=1e-11)
    # The second is an equilibrium there, a saddle that pulling from rest does not lead to.
    assert found[0].stable and not found[1].stable
    path = pull_from_rest(found[1].finger, found[1].pulls, shape)
    assert not path.reached and path.squared_error > 1e-6


def test_without_a_pull_the_rest_shape_is_the_wanted_one():
    finger = make_finger()
    shape = on_curve("helix:0.02,turns=1", finger)
    for pull in (0.0, -0.004):
        found = the_one(RestShapeSolver(finger).solve(shape, {"helical": Pull(pull)}))
        assert found.tensions.tolist() == [0.0] and found.energy == 0.0
        assert found.rest == pytest.approx(shape.points, abs=1e-12)
        assert found.pulls == pytest.approx([pull], abs=1e-15)
        assert_reached(found, shape, steps=1)
    assert RestShapeSolver(finger).solve(shape, {}).shapes[0].energy == 0.0


def test_a_cable_that_is_not_named_holds_unless_it_is_paid_out():
    """Opposite cables: bent towards one, the other is stretched, and pulls too."""
    finger = make_finger(straight_cable(1, name="front"), straight_cable(7, name="back"))
    shape = on_curve("arc:60", finger)
    solver = RestShapeSolver(finger)
    refused = solver.solve(shape, percent(2, "front") | percent(2, "back"))
    assert not refused.shapes and "no tensions give these pulls" in refused.refused[0]
    (line,) = (r for r in refused.refused if "cable back paid out by" in r)
    more = float(line.partition("by ")[2].partition(" mm")[0]) / 1e3
    rest = solver.solve(shape, percent(2, "front") | percent(-5, "back")).shapes[0].rest_lengths[1]
    out = {"back": Pull(0.02 * rest - 1.001 * more)}
    assert the_one(solver.solve(shape, percent(2, "front") | out)).tensions[1] == 0
    paid = the_one(solver.solve(shape, percent(2, "front") | percent(-5, "back")))
    assert paid.tensions[0] > 0 and paid.tensions[1] == 0
    assert paid.pulls[1] == pytest.approx(-0.05 * paid.rest_lengths[1])
    assert_reached(paid, shape)


def test_several_cables_hold_and_several_may_be_slack():
    cables = [straight_cable(h, name=f"c{h}") for h in (1, 5, 9)]
    finger = make_finger(*cables)
    shape = wandering_shape(finger, 5, bend=6.0)
    pulls = percent(3, "c1") | percent(2.5, "c5") | percent(-9, "c9")
    found = RestShapeSolver(finger).solve(shape, pulls).shapes[0]
    assert (found.tensions[:2] > 0).all() and found.tensions[2] == 0
    assert_reached(found, shape)


def test_a_cable_that_would_have_to_push_is_named_with_the_force():
    finger = make_finger(*(straight_cable(h, name=f"c{h}") for h in (1, 5, 9)))
    shape = wandering_shape(finger, 5, bend=6.0)
    pulls = percent(3, "c1") | percent(2.5, "c5") | percent(-6, "c9")
    design = RestShapeSolver(finger).solve(shape, pulls)
    assert not design.shapes
    assert any(
        "cable c9 would have to push with 817.4 1/m^2 per EI, which a cable cannot" in line
        for line in design.refused
    )
    assert any("cable c9 paid out by" in line for line in design.refused)


def test_a_bound_on_the_rest_curvature():
    """The wanted shape bends by 16.7 1/m; a rest shape may bend less, or more."""
    finger = sphere_finger()
    shape = on_curve(SPHERE, finger)
    solver = RestShapeSolver(finger)
    assert the_one(solver.solve(shape, percent(3), max_curvature=14.0)).largest_curvature < 13.1
    design = solver.solve(shape, percent(3), max_curvature=12.0)
    assert design.shapes == ()
    (line,) = design.refused
    assert "tension of 5.55 bends by 13.09 1/m at rest, more than the 12 1/m allowed" in line


def test_a_pull_that_no_rest_shape_allows():
    finger = sphere_finger()
    shape = on_curve(SPHERE, finger)
    solver = RestShapeSolver(finger)
    design = solver.solve(shape, percent(60))
    assert design.shapes == ()
    (line,) = design.refused
    assert "bends by less than 125 1/m: the pull can be " in line and "% at most" in line
    most = float(line.rpartition("be ")[2].partition("%")[0])
    assert 30 < most < 60
    near = the_one(solver.solve(shape, percent(0.999 * most)))
    assert 100 < near.largest_curvature < 125
    (line,) = solver.solve(shape, {"main": Pull(0.18)}).refused
    assert "mm at most" in line


@pytest.mark.parametrize("curve", ["arc:300,direction=180", "s:150", "arc:160"])
def test_disks_do_not_meet_at_rest(curve):
    """The bound on curvature, 1 / disk radius, is where neighbouring disks would."""
    finger = sphere_finger()
    most = 0.0
    for pull in (3, 12, 20, 25, 30, 35):
        for found in RestShapeSolver(finger).solve(on_curve(curve, finger), percent(pull)).shapes:
            rest = FingerSolver(found.finger).rest
            axes = rest.frames[:, :, 2]
            assert disk_overlap(rest.backbone, axes, finger.disk_radius).max() < 0
            most = max(most, found.largest_curvature)
    assert 50 < most < 125


FINGER = sphere_finger(obstacles=(BALL,))


@pytest.mark.parametrize(
    ("pulls", "presses", "limit", "error", "words"),
    [
        ({"other": Pull(0.001)}, [], None, UnknownName, "unknown cable 'other'; valid: main"),
        ({"main": 0.03}, [], None, InvalidValue, "pulls.main"),
        (percent(100), [], None, InvalidValue, "pulls.main"),
        ({"main": Pull(math.nan)}, [], None, InvalidValue, "pulls.main"),
        ({"main": Pull(5.0)}, [], None, InvalidValue, "pulls.main"),
        (percent(3), [Press(10, 0.1)], None, InvalidValue, r"press\[0\].disk.*an integer 1..9"),
        (percent(3), [Press(2, 0.1)], None, InvalidValue, r"press\[0\].*mm off 'ball'"),
        (percent(3), [Press(7, 0.1)] * 2, None, InvalidValue, r"press\[1\].*once per point"),
        (percent(3), [Press(7, 0.1, "backbone")], None, InvalidValue, r"is 8 mm off 'ball'"),
        (percent(3), [Press(7, 0.1, "cable", "no")], None, UnknownName, "unknown cable 'no'"),
        (percent(3), [], 0.0, InvalidValue, "max_curvature"),
        (percent(3), [], 200.0, InvalidValue, "max_curvature.*<= 125"),
    ],
)
def test_bad_values(pulls, presses, limit, error, words):
    with pytest.raises(error, match=words):
        RestShapeSolver(FINGER).solve(on_curve(SPHERE, FINGER), pulls, presses, limit)


def test_bad_presses():
    with pytest.raises(UnknownName, match="backbone, cable, antagonist"):
        Press(3, 0.1, "rim")
    for disk, force, place in ((0, 0.1, "press.disk"), (3, 0.0, "press.force")):
        with pytest.raises(InvalidValue, match=place):
            Press(disk, force)
    with pytest.raises(InvalidValue, match="with an obstacle to press on"):
        plain = sphere_finger()
        RestShapeSolver(plain).solve(on_curve(SPHERE, plain), percent(3), [Press(7, 0.1)])


def test_shapes_that_do_not_fit_are_refused():
    with pytest.raises(InvalidValue, match="10 points, one per disk"):
        RestShapeSolver(FINGER).solve(DesiredShape(np.zeros((4, 3))), percent(3))
    wall = Plane([0.0, 0.0, 0.15], [0.0, 0.0, -1.0], name="ceiling")
    walled = sphere_finger(obstacles=(wall,))
    with pytest.raises(
        InvalidValue, match=r"clear of obstacle 'ceiling' .it is .* mm inside.; `best_fit`"
    ):
        RestShapeSolver(walled).solve(on_curve(SPHERE, walled), percent(3))
