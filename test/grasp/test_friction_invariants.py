# SPDX-License-Identifier: Apache-2.0
"""What holds after any sequence of solves, loads and releases of a grasp with friction."""

from dataclasses import replace

import numpy as np
import pytest
from friction_cases import LONG, G, pinch, three_on_a_ball
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ccr_ros.grasp.statics import GraspSolver, sphere_body
from ccr_ros.model import InvalidValue, MountedFinger

GRASPS = {"cube": lambda: pinch(0.5), "ball": lambda: three_on_a_ball(0.4)}


@pytest.fixture(scope="module")
def grasps():
    made = {name: make() for name, make in GRASPS.items()}
    return {name: (solver, solver.standing) for name, solver in made.items()}


def lasting(solver):
    pose = solver.body.pose
    return [
        *pose.position, *pose.orientation, solver.body.mass, solver.supported,
        *np.concatenate(list(solver.pulls.values())),
    ]  # fmt: skip


def check(solver, solution):
    pose, body = solution.body.pose, solution.body
    assert np.linalg.norm(pose.orientation) == pytest.approx(1.0, abs=1e-12)
    assert np.isfinite(pose.position).all() and solution.dissipated >= 0.0
    force, moment = np.zeros(3), np.zeros(3)
    for contact in solution.contacts:
        along = float(np.linalg.norm(contact.friction_force))
        assert contact.force > 0 and abs(contact.friction_force @ contact.normal) < 1e-9
        assert along <= body.friction * contact.force * (1 + 1e-6) + 1e-12
        if contact.status == "slip":
            assert along == pytest.approx(body.friction * contact.force, rel=1e-5)
        push = -contact.force * contact.normal - contact.friction_force
        force += push
        moment += np.cross(contact.position - pose.position, push)
    grip = sum(contact.force for contact in solution.contacts)
    if not solution.supported:
        assert np.abs(solution.net_force).max() < 1e-6 * grip
        assert np.abs(solution.net_moment).max() < 1e-6 * grip * 0.1
    shape = body.shape.moved(pose)
    for mounted, finger in zip(solver.hand.mounted, solution.fingers, strict=True):
        points = [finger.backbone, *finger.cables.values(), *finger.antagonists.values()]
        where = mounted.base.points(np.concatenate([p[1:] for p in points]))
        assert shape.signed_distance(where).min() > -1e-8
        assert (finger.tensions >= 0).all()


PULL = st.floats(0.0004, 0.0013)
SMALL = st.floats(-0.01, 0.01)
OPERATIONS = st.one_of(
    st.tuples(st.just("pull"), st.sampled_from(["finger_1", "finger_2"]), PULL),
    st.tuples(st.just("force"), st.tuples(SMALL, SMALL, SMALL)),
    st.tuples(st.just("mass"), st.floats(0.0, 0.01)),
    st.tuples(st.just("let_go")),
    st.tuples(st.just("support")),
)


@settings(max_examples=12, deadline=None, suppress_health_check=list(HealthCheck))
@given(name=st.sampled_from(sorted(GRASPS)), operations=st.lists(OPERATIONS, max_size=5))
def test_any_sequence_leaves_an_equilibrium_or_what_was(grasps, name, operations):
    solver, standing = grasps[name]
    solver.resume(standing)
    for kind, *values in [("let_go",), *operations]:
        before = lasting(solver)
        if kind == "support":
            solver.support()
            continue
        if kind == "let_go":
            solution = solver.let_go()
        elif kind == "pull":
            solution = solver.solve({values[0]: [values[1]]})
        else:
            solution = solver.solve({}, **{kind: values[0]})
        if solution.converged:
            check(solver, solution)
        else:
            assert solution.message and lasting(solver) == before


def test_a_cube_between_two_points_hangs_like_a_pendulum():
    """Two points carry no moment about the line through them; the weight below it does."""
    solver = pinch(0.5)
    held = solver.let_go().require_converged()
    below = np.mean([c.position[2] for c in held.contacts]) - held.body.pose.position[2]
    assert below > 5e-4
    for share in (0.1, -0.5):
        moment = share * held.body.mass * G * below
        turned = solver.solve({}, moment=[moment, 0.0, 0.0]).require_converged()
        angle = 2 * np.arcsin(turned.body.pose.orientation[0])
        assert np.sin(angle) == pytest.approx(share, rel=0.02)


def test_cycles_that_stick_leave_no_trace():
    solver = three_on_a_ball(0.6)
    held = solver.let_go().require_converged()
    for _ in range(15):
        away = solver.solve({"finger_1": [0.0010]}).require_converged()
        back = solver.solve({"finger_1": [0.0008]}).require_converged()
        assert away.dissipated == back.dissipated == 0.0
    assert np.abs(back.body.pose.position - held.body.pose.position).max() < 1e-12
    assert back.energy == pytest.approx(held.energy, rel=1e-9)


def test_a_mass_is_refused_while_forces_are_not_in_newtons():
    mounted = pinch().hand.mounted[0]
    finger = replace(mounted.finger, youngs_modulus=None)
    solver = GraspSolver([MountedFinger(finger, mounted.base)], sphere_body(0.04), LONG)
    with pytest.raises(InvalidValue, match="youngs_modulus"):
        solver.solve({}, mass=0.1)
    assert solver.point is None
