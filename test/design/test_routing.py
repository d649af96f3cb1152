# SPDX-License-Identifier: Apache-2.0
"""Routings for wanted shapes: the paper's and random ones come back, from poses and centres."""

from __future__ import annotations

import numpy as np
import pytest
from model.fingers import DATA, make_finger, reference, straight_cable

from ccr_ros.design.pull import Pull
from ccr_ros.design.routing import design_routing
from ccr_ros.design.target import DesiredShape
from ccr_ros.model import (
    Cable,
    Finger,
    FingerSolver,
    InvalidValue,
    Solution,
    Sphere,
    load_finger,
)
from ccr_ros.resources import find_config

PAPER = {"helical": 0.040, "general_1": 0.037, "general_2": 0.033}  # Table I


def holes_of(finger: Finger) -> tuple[tuple[int, ...], ...]:
    steps = [np.round(c.angles * finger.holes_per_disk / (2 * np.pi)) for c in finger.cables]
    return tuple(tuple(int(k) % finger.holes_per_disk + 1 for k in s) for s in steps)


def pulled(finger: Finger, *fractions: float) -> Solution:
    solver = FingerSolver(finger)
    return solver.solve(np.array(fractions) * solver.rest_lengths).require_converged()


def fractions(*values: float) -> list[Pull]:
    return [Pull(v, relative=True) for v in values]


@pytest.mark.parametrize("frames", [True, False], ids=["poses", "centres"])
@pytest.mark.parametrize("name", PAPER)
def test_the_papers_routings_come_back(name, frames):
    finger, pull = load_finger(find_config(name)), PAPER[name]
    solution = pulled(finger, pull)
    shape = DesiredShape(solution.backbone, solution.frames if frames else None)
    design = design_routing(make_finger(straight_cable()), shape, fractions(pull))
    assert design.best.holes == holes_of(finger)
    assert design.reached and design.best.max_error < 1e-10
    assert design.alike == 1 and len(design.candidates) == 5


@pytest.mark.parametrize("frames", [True, False], ids=["poses", "centres"])
@pytest.mark.parametrize("name", PAPER)
def test_the_papers_routings_come_back_from_independent_poses(name, frames):
    """The reference's rod is integrated as an ODE: it is not exactly the model's."""
    data, finger = reference(name), load_finger(find_config(name))
    state = data["states"][-1]
    assert state["pull"] == [PAPER[name]] and DATA.is_dir()
    shape = DesiredShape(state["backbone"], state["frames"] if frames else None)
    design = design_routing(make_finger(straight_cable()), shape, fractions(PAPER[name]))
    assert design.best.holes == holes_of(finger)
    assert design.reached and 0 < design.best.max_error < 5e-5


def random_finger(rng: np.random.Generator, bent: bool, smooth: bool, cables: int = 1) -> Finger:
    rest = rng.normal(size=(9, 3)) * [4.0, 4.0, 1.0] if bent else None
    routings = [
        np.cumsum(rng.integers(-2, 3, 10)) % 12 + 1 if smooth else rng.integers(1, 13, 10)
        for _ in range(cables)
    ]
    named = [Cable.from_holes(f"c{i}", r.tolist()) for i, r in enumerate(routings)]
    return make_finger(*named, rest_curvature=rest)


@pytest.mark.parametrize("seed", range(8))
def test_random_routings_come_back(seed):
    rng = np.random.default_rng(seed)
    finger = random_finger(rng, bent=seed % 4 == 3, smooth=seed % 2 == 1)
    pull = float(rng.uniform(0.01, 0.05))
    solution = pulled(finger, pull)
    exact = design_routing(finger, DesiredShape.of(solution), fractions(pull))
    assert exact.best.holes == holes_of(finger)
    centres = design_routing(finger, DesiredShape(solution.backbone), fractions(pull))
    assert centres.reached
    assert centres.best.holes == holes_of(finger) or centres.best.max_error < 1e-4


@pytest.mark.parametrize(
    ("segments", "holes_per_disk"), [(2, 12), (9, 24), (9, 3), (9, 1), (30, 12)]
)
def test_other_fingers(segments, holes_per_disk):
    rng = np.random.default_rng(segments + holes_per_disk)
    walk = np.cumsum(rng.integers(-1, 2, segments + 1)) % holes_per_disk + 1
    cable = Cable.from_holes("c", walk.tolist(), holes_per_disk)
    finger = make_finger(cable, segments=segments, holes_per_disk=holes_per_disk)
    design = design_routing(finger, DesiredShape.of(pulled(finger, 0.03)), fractions(0.03))
    assert design.best.holes == holes_of(finger)


def test_a_rest_shape_that_varies_along_segments():
    """The search has one piece to a segment; the answer is the forward model's all the same."""
    rng = np.random.default_rng(3)
    finger = make_finger(
        Cable("c", rng.uniform(0, 2 * np.pi, 10)), rest_curvature=3 * rng.normal(size=(9, 4, 3))
    )
    assert finger.rest_pieces == 2
    shape = DesiredShape.of(pulled(finger, 0.03))
    design = design_routing(finger, shape, fractions(0.03), free=True)
    assert design.best.rms_error < 1e-9
    assert angle_errors(design.best.finger, finger).max() < 1e-6


def angle_errors(a: Finger, b: Finger) -> np.ndarray:
    pairs = zip(a.cables, b.cables, strict=True)
    return np.array([np.abs(np.angle(np.exp(1j * (p.angles - q.angles)))) for p, q in pairs])


@pytest.mark.parametrize("seed", range(3))
def test_free_angles_come_back(seed):
    rng = np.random.default_rng(100 + seed)
    rest = rng.normal(size=(9, 3)) * [4.0, 4.0, 1.0] if seed % 3 == 2 else None
    angles = rng.uniform(0, 2 * np.pi, 10) if seed % 2 else np.cumsum(rng.uniform(-1, 1, 10))
    finger = make_finger(Cable("c", angles), rest_curvature=rest)
    pull = float(rng.uniform(0.01, 0.05))
    solution = pulled(finger, pull)
    poses = design_routing(finger, DesiredShape.of(solution), fractions(pull), free=True)
    assert poses.best.holes is None
    assert poses.best.max_error < 1e-9  # 1e-6 mm
    assert angle_errors(poses.best.finger, finger).max() < 1e-5
    centres = design_routing(finger, DesiredShape(solution.backbone), fractions(pull), free=True)
    assert centres.best.max_error < 1e-9
    angles = centres.best.finger.cables[0].angles
    assert ((angles >= 0) & (angles < 2 * np.pi)).all()


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 2])
def test_two_cables_come_back(seed):
    rng = np.random.default_rng(200 + seed)
    while True:
        finger = random_finger(rng, bent=seed == 2, smooth=True, cables=2)
        pull = rng.uniform(0.005, 0.02, 2)
        solution = pulled(finger, *pull)
        if not solution.slack.any():
            break
    exact = design_routing(finger, DesiredShape.of(solution), fractions(*pull))
    assert exact.best.holes == holes_of(finger)


@pytest.mark.long
def test_two_cables_with_free_angles_come_back():
    rng = np.random.default_rng(7)
    cables = [Cable(name, np.cumsum(rng.uniform(-1, 1, 10))) for name in ("a", "b")]
    finger = make_finger(*cables)
    shape = DesiredShape.of(pulled(finger, 0.015, 0.01))
    design = design_routing(finger, shape, fractions(0.015, 0.01), free=True)
    assert design.best.max_error < 1e-9
    assert angle_errors(design.best.finger, finger).max() < 1e-5


@pytest.mark.long
@pytest.mark.parametrize("pull", [(0.02, 0.02), (0.015, 0.01)])
def test_two_cables_come_back_from_centres_alone(pull):
    finger = load_finger(find_config("two_cables"))
    solution = pulled(finger, *pull)
    design = design_routing(finger, DesiredShape(solution.backbone), fractions(*pull))
    assert sorted(design.best.holes) == sorted(holes_of(finger))


def test_the_largest_change_of_a_hole():
    finger = load_finger(find_config("general_1"))
    shape = DesiredShape(pulled(finger, 0.037).backbone)
    one = design_routing(finger, shape, fractions(0.037), largest_change=1)
    assert one.best.holes == holes_of(finger)
    straight = design_routing(finger, shape, fractions(0.037), largest_change=0)
    assert not straight.reached
    for design, most in ((one, 1), (straight, 0)):
        for candidate in design.candidates:
            change = np.abs(np.diff(candidate.holes[0]))
            assert np.minimum(change, 12 - change).max() <= most


def test_cables_that_are_pulled_alike_are_given_once():
    finger = make_finger(straight_cable(1, name="a"), straight_cable(4, name="b"))
    shape = DesiredShape.of(pulled(finger, 0.02, 0.02))
    design = design_routing(finger, shape, fractions(0.02, 0.02))
    assert sorted(design.best.holes) == sorted(holes_of(finger))
    assert len({tuple(sorted(c.holes)) for c in design.candidates}) == len(design.candidates)


def test_a_mirrored_routing_is_listed_with_its_twin():
    """An arc in the x-z plane; what bends it in the plane's mirror image is as near."""
    s = np.linspace(0, 1, 10) * np.radians(60)
    radius = 0.182 / np.radians(60)
    arc = np.stack([radius * (1 - np.cos(s)), 0 * s, radius * np.sin(s)], axis=1)
    design = design_routing(make_finger(), DesiredShape(arc), fractions(0.046))
    best, twin = design.candidates[:2]
    assert best.max_error == pytest.approx(twin.max_error, rel=1e-6)
    mirrored = tuple((1 - h) % 12 + 1 for h in best.holes[0])
    assert best.holes != twin.holes and twin.holes == (mirrored,)


def test_what_no_routing_reaches_is_fitted_and_told():
    """Pulled by 4 %, no finger bends by 10 degrees only along a plane arc."""
    s = np.linspace(0, 1, 10) * np.radians(10)
    radius = 0.182 / np.radians(10)
    arc = np.stack([radius * (1 - np.cos(s)), 0 * s, radius * np.sin(s)], axis=1)
    design = design_routing(make_finger(), DesiredShape(arc), fractions(0.04))
    assert not design.reached and design.alike == 0
    best = design.best
    assert design.tolerance < best.max_error < 0.01
    assert best.errors == pytest.approx(DesiredShape(arc).errors(best.solution.backbone))
    straight = pulled(make_finger(straight_cable(1)), 0.04)
    assert best.rms_error < 0.1 * np.sqrt(np.mean(DesiredShape(arc).errors(straight.backbone) ** 2))
    costs = [c.cost for c in design.candidates]
    assert costs == sorted(costs)


@pytest.mark.parametrize("seed", range(2))
def test_noise_on_measured_centres_does_no_more_than_noise(seed):
    """The shape found is at least as near to what was measured as the true one is."""
    rng = np.random.default_rng(300 + seed)
    finger = random_finger(rng, bent=False, smooth=seed % 2 == 0)
    solution = pulled(finger, 0.035)
    points = solution.backbone.copy()
    points[1:] += rng.normal(scale=2e-4, size=(9, 3))
    design = design_routing(finger, DesiredShape(points), fractions(0.035), tolerance=1e-3)
    assert design.reached
    assert design.best.cost <= DesiredShape(points).squared_error(solution.backbone) * 1.0001
    off = DesiredShape.of(solution).errors(design.best.solution.backbone)
    assert off.max() < 1e-3


def test_without_pull_every_routing_gives_the_rest_shape():
    finger = make_finger(rest_curvature=[[0, 3.0, 0]] * 9)
    rest = FingerSolver(finger).rest
    design = design_routing(finger, DesiredShape.of(rest), fractions(0.0))
    assert design.reached and design.best.max_error < 1e-12
    assert "every routing" in design.note
    elsewhere = design_routing(make_finger(), DesiredShape(rest.backbone), fractions(0.0))
    assert not elsewhere.reached


def test_a_pull_in_metres_is_the_same_as_its_share_of_the_rest_length():
    finger = load_finger(find_config("helical"))
    solution = pulled(finger, 0.04)
    shape = DesiredShape.of(solution)
    design = design_routing(finger, shape, [Pull(float(solution.pulls[0]))])
    assert design.best.holes == holes_of(finger)
    assert design.best.solution.pulls == pytest.approx(solution.pulls, abs=1e-15)


def test_what_comes_out_is_the_forward_models():
    finger = load_finger(find_config("general_2"))
    design = design_routing(finger, DesiredShape.of(pulled(finger, 0.033)), fractions(0.033))
    for candidate in design.candidates:
        again = pulled(candidate.finger, 0.033)
        assert np.array_equal(again.backbone, candidate.solution.backbone)
        assert candidate.rms_error <= candidate.max_error
        assert candidate.finger.cable_names == finger.cable_names
        assert candidate.turn is not None and candidate.turn >= 0


SHAPE = DesiredShape(np.linspace([0, 0, 0], [0, 0, 0.182], 10))


@pytest.mark.parametrize(
    ("pulls", "place"),
    [
        ([], "pulls"),
        (fractions(0.01, 0.01, 0.01), "pulls"),
        (0.01, "pulls"),
        ([0.01], r"pulls\[0\]"),
        (fractions(-0.01), r"pulls\[0\]"),
        (fractions(1.0), r"pulls\[0\]"),
        (fractions(float("nan")), r"pulls\[0\]"),
        ([Pull(0.182)], r"pulls\[0\]"),
        ([Pull("4%")], r"pulls\[0\]"),
        (fractions(0.01, 0.0), "pulls"),
    ],
)
def test_bad_pulls(pulls, place):
    with pytest.raises(InvalidValue, match=rf"^{place}: ") as error:
        design_routing(make_finger(), SHAPE, pulls)
    assert error.value.place.startswith("pulls")


def test_bad_shapes_fingers_and_options():
    finger, pull = make_finger(), fractions(0.03)

    def refused(match, shape=SHAPE, finger=finger, **options):
        with pytest.raises(InvalidValue, match=match):
            design_routing(finger, shape, options.pop("pulls", pull), **options)

    refused("10 points, one per disk", DesiredShape(SHAPE.points[:8]))
    points = SHAPE.points.copy()
    points[4] += [0.01, 0, 0.005]
    refused(r"points\[4\].*18.2 to|points\[4\].*10.1 to 22.2 mm", DesiredShape(points))
    points[4] = points[3]
    refused(r"points\[4\]", DesiredShape(points))
    ball = Sphere(np.array([0.1, 0, 0.1]), 0.02, name="ball")
    refused("obstacles", finger=make_finger(obstacles=(ball,)))
    many = make_finger(Cable.from_holes("c", [1] * 10, 200), holes_per_disk=200)
    refused("holes_per_disk", finger=many)
    refused("largest_change", largest_change=-1)
    refused("largest_change", largest_change=1, free=True)
    refused("candidates", candidates=0)
    refused("candidates", candidates=1.5)
    refused("tolerance", tolerance=0.0)
    refused("tolerance", tolerance=float("nan"))
    refused("pulls.*small enough", pulls=fractions(0.9))
