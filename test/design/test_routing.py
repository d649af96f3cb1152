# SPDX-License-Identifier: Apache-2.0
"""Routings for wanted shapes: the paper's and random ones come back, from poses and centres."""

from __future__ import annotations

import numpy as np
import pytest
from model.fingers import DATA, make_finger, reference, straight_cable

from ccr_ros.design.routing import Pull, design_routing
from ccr_ros.design.target import DesiredShape
from ccr_ros.model import Cable, Finger, FingerSolver, Solution, load_finger
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


@pytest.mark.parametrize("seed", range(12))
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
