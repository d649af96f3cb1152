# SPDX-License-Identifier: Apache-2.0
"""Fingers evaluated and solved at once are what they are one by one."""

from dataclasses import fields, replace

import numpy as np
import pytest
from friction_cases import LONG, about, cube, finger

from ccr_ros.grasp.statics import GraspSolver, sphere_body
from ccr_ros.grasp.statics.assembly import Hand, derive
from ccr_ros.grasp.statics.friction import Hold
from ccr_ros.grasp.statics.meeting import Guess
from ccr_ros.model import Cable, MountedFinger, Pose, Sphere

WALL = Sphere(np.array([0.03, 0.0, 0.1]), 0.02, name="wall")


def hand_of(*made, radius=0.03):
    mounted = []
    for k, one in enumerate(made):
        angle = 2 * np.pi * k / len(made)
        where = radius * np.array([np.cos(angle), np.sin(angle), 0.0])
        base = Pose(where, about([0, 0, 1], angle + np.pi))
        mounted.append(MountedFinger(replace(one, name=f"finger_{k + 1}"), base))
    return mounted


def with_two_cables(mounted):
    cables = [Cable("a", np.zeros(7)), Cable("b", np.full(7, np.pi / 2))]
    return replace(mounted, finger=replace(mounted.finger, cables=cables))


def leaves(thing):
    if isinstance(thing, np.ndarray | float):
        return [thing]
    return [leaf for field in fields(thing) for leaf in leaves(getattr(thing, field.name))]


def guess(problem, obstacles, rng):
    """Something near a grasp: bent towards the object, all that is near it pressing and rubbing."""
    points = len(problem.points.labels)
    hold = Hold(
        rng.normal(scale=0.1, size=(points, 3)),
        rng.normal(scale=0.3, size=(points, 3)),
        rng.random(points) < 0.5,
    )
    forces = np.zeros((obstacles, points))
    pressing = rng.choice(np.flatnonzero(~problem.fixed), 4, replace=False)
    forces[rng.integers(0, obstacles, 4), pressing] = rng.uniform(0.5, 2.0, 4)
    y = 0.1 * rng.normal(size=problem.size)
    return Guess(y, rng.uniform(0.0, 3.0, len(problem.group_cable)), forces, hold)


@pytest.mark.parametrize("walls", [(0, 0, 0), (0, 1, 0), (2, 0, 1)])
def test_derivatives_are_those_of_each_finger_alone(walls):
    rng = np.random.default_rng(sum(walls))
    made = [finger(f"f{k}", holes=(0.1 * k,), length=0.12 + 0.01 * k) for k in range(len(walls))]
    made = [replace(f, obstacles=(WALL,) * n) for f, n in zip(made, walls, strict=True)]
    mounted = hand_of(*made)
    body = cube(0.5, 0.002)
    together = Hand(mounted)
    assert together.alike == ((0, 1, 2),)
    guesses = [guess(p, 1 + len(p.finger.obstacles), rng) for p in together.problems]
    parts = derive(together, body, body.pose, guesses)
    for part, one, own in zip(parts, mounted, guesses, strict=True):
        k = mounted.index(one)
        others = [with_two_cables(m) for m in mounted]  # as long, so that units are the same
        alone = Hand([*others[:k], one, *others[k + 1 :]])
        assert (k,) in alone.alike
        rest = [guess(p, 1 + len(p.finger.obstacles), rng) for p in alone.problems]
        wanted = derive(alone, body, body.pose, [*rest[:k], own, *rest[k + 1 :]])[k]
        assert len(wanted.friction) > 0 or not len(part.friction)
        for a, b in zip(leaves(part), leaves(wanted), strict=True):
            np.testing.assert_allclose(a, b, atol=1e-11)
        unlike = Hand([one]).problems[0]
        unlike.obstacles = (*one.finger.obstacles, body.shape.moved(one.base.inverse() @ body.pose))
        at = unlike.evaluate(own.y)
        np.testing.assert_allclose(part.point.at.distances, at.distances, atol=1e-13)
        slopes = unlike.linearize(at)
        rows, normals, bends = unlike.contact_rows(at, slopes, part.point.pairs)
        lengths = len(own.tensions)
        np.testing.assert_allclose(part.point.rows[:lengths], slopes.lengths, atol=1e-12)
        np.testing.assert_allclose(part.point.rows[lengths:], rows, atol=1e-12)
        np.testing.assert_allclose(part.point.normals, normals, atol=1e-12)
        np.testing.assert_allclose(part.point.curvatures, bends, atol=1e-9)


def held(mounted, friction):
    ball = sphere_body(0.04, 0.002, Pose(np.array([0.0, 0.0, 0.118])), friction)
    solver = GraspSolver(mounted, ball, LONG)
    solver.solve({name: pulls_of(solver, name) for name in solver.names}).require_converged()
    return solver, solver.let_go().require_converged()


def pulls_of(solver, name):
    (one,) = (m.finger for m in solver.hand.mounted if m.finger.name == name)
    return [0.0008] + [-0.002] * (len(one.cables) - 1)  # a second cable hangs loose


@pytest.mark.parametrize("friction", [0.0, 0.6])
def test_a_grasp_does_not_care_who_is_solved_with_whom(friction):
    """A loose cable, or a far obstacle, changes nothing but which fingers are alike."""
    plain = finger("f")
    loose = finger("f", holes=(0.0, np.pi))  # the points are the same
    far = replace(plain, obstacles=(Sphere(np.array([9.0, 0.0, 0.0]), 0.1, name="far"),))
    _, wanted = held(hand_of(plain, plain, plain), friction)
    for others in ((plain, loose, plain), (far, plain, far), (loose, far, plain)):
        solver, found = held(hand_of(*others), friction)
        assert len(solver.hand.alike) == (2 if loose in others else 1)
        assert len(found.contacts) == len(wanted.contacts) >= 3
        np.testing.assert_allclose(found.body.pose.position, wanted.body.pose.position, atol=1e-9)
        for a, b in zip(found.contacts, wanted.contacts, strict=True):
            assert (a.finger, a.disk) == (b.finger, b.disk)
            assert a.force == pytest.approx(b.force, rel=1e-6)
            np.testing.assert_allclose(a.friction_force, b.friction_force, atol=1e-6 * b.force)


def test_solutions_are_put_together_from_where_they_were_solved():
    """What is asked for late is that of its own solve, whatever was solved since."""
    solver, early = held(hand_of(*[finger("f")] * 3), 0.0)
    wanted = early.body.pose.position.copy(), early.net_force.copy()
    late = solver.solve({name: [0.0009] for name in solver.names})
    assert late.fingers[0].pulls[0] == 0.0009
    assert early.fingers[0].pulls[0] == 0.0008
    assert early.fingers[0].certificate.cable_error < 1e-9
    assert early.fingers[0].contacts[0].obstacle == "ball"
    force = sum(c.force for c in early.contacts)
    assert force != pytest.approx(sum(c.force for c in late.contacts), rel=1e-3)
    np.testing.assert_array_equal(early.body.pose.position, wanted[0])
    np.testing.assert_array_equal(early.net_force, wanted[1])


def test_a_finger_with_two_cables_beside_fingers_with_one():
    """Groups of unlike fingers are put back in the gripper's order."""
    two = replace(finger("f"), cables=[Cable("a", np.zeros(7)), Cable("b", np.full(7, np.pi / 2))])
    mounted = hand_of(finger("f"), two, finger("f"))
    solver = GraspSolver(mounted, sphere_body(0.04, 0.002, Pose(np.array([0.0, 0.0, 0.118]))))
    solver.solve({"finger_1": [8e-4], "finger_2": [8e-4, -1e-3], "finger_3": [8e-4]})
    found = solver.let_go().require_converged()
    assert solver.hand.alike == ((0, 2), (1,))
    assert [f.finger.name for f in found.fingers] == ["finger_1", "finger_2", "finger_3"]
    assert [len(f.tensions) for f in found.fingers] == [1, 2, 1]
    push = sum(-c.force * c.normal for c in found.contacts)
    np.testing.assert_allclose(push, [0.0, 0.0, 0.002 * 9.80665], atol=1e-9)
