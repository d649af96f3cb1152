# SPDX-License-Identifier: Apache-2.0
"""Small grasps with friction whose answers are known: shared by the tests of friction."""

import numpy as np

from ccr_ros.grasp.statics import Body, GraspSolver, sphere_body
from ccr_ros.model import Box, Cable, Finger, MountedFinger, Pose, SolverSettings
from ccr_ros.model.rotation import quaternion_from_matrix

G = 9.80665
LONG = SolverSettings(time_limit=60.0)


def finger(name, holes=(0.0,), length=0.12):
    cables = [Cable(f"c{i}", [angle] * 7) for i, angle in enumerate(holes)]
    return Finger(
        name=name,
        length=length,
        segments=6,
        disk_radius=0.008,
        backbone_diameter=0.0025,
        poisson_ratio=0.39,
        youngs_modulus=2.8e9,
        cables=cables,
    )


def about(axis, angle):
    return np.append(np.sin(angle / 2) * np.asarray(axis, dtype=float), np.cos(angle / 2))


def around(count, radius, turn=None):
    """Fingers on a circle, each with its +x towards the axis."""
    turn = Pose() if turn is None else turn
    found = []
    for k in range(count):
        angle = 2 * np.pi * k / count
        where = radius * np.array([np.cos(angle), np.sin(angle), 0.0])
        base = turn @ Pose(where, about([0, 0, 1], angle + np.pi))
        found.append(MountedFinger(finger(f"finger_{k + 1}"), base))
    return found


def cube(friction, mass, turn=None, side=0.04, height=0.118):
    turn = Pose() if turn is None else turn
    shape = Box(np.zeros(3), np.full(3, side), edge_radius=0.001, name="cube")
    return Body(shape, mass, turn @ Pose(np.array([0.0, 0.0, height])), friction)


def pinch(friction=0.5, mass=0.002, pull=0.0008, turn=None):
    """Two fingers face to face press on a cube between their tips."""
    turn = Pose() if turn is None else turn
    solver = GraspSolver(
        around(2, 0.03, turn),
        cube(friction, mass, turn),
        LONG,
        gravity=turn.vectors(np.array([0.0, 0.0, -G])),
    )
    solver.solve({name: [pull] for name in solver.names}).require_converged()
    return solver


def three_on_a_ball(friction=0.5, mass=0.002, pull=0.0008):
    """Three fingers press on a ball with one point each."""
    ball = sphere_body(0.04, mass, Pose(np.array([0.0, 0.0, 0.118])), friction)
    solver = GraspSolver(around(3, 0.03), ball, LONG)
    solver.solve({name: [pull] for name in solver.names}).require_converged()
    return solver


def on_four_cantilevers(friction, slope):
    """A block lies on the tips of four level fingers; all of it is inclined by ``slope`` [rad].

    It is as heavy as the fingers press, so that it does not sink (and slide) when it is let go.
    """
    fingers = []
    for k, (x, side) in enumerate([(-0.015, 1), (0.015, 1), (-0.015, -1), (0.015, -1)]):
        # z of the finger along -side * y, its x axis up
        turn = np.column_stack([[0.0, 0.0, 1.0], np.cross([0.0, -side, 0.0], [0.0, 0.0, 1.0]),
                                [0.0, -side, 0.0]])  # fmt: skip
        base = Pose(np.array([x, side * 0.13, 0.0]), quaternion_from_matrix(turn))
        fingers.append(MountedFinger(finger(f"finger_{k + 1}"), base))
    shape = Box(np.zeros(3), np.array([0.06, 0.06, 0.02]), edge_radius=0.001, name="block")
    # The fingers' upper cable holes are 8 mm above their axes; the block bends them a little.
    body = Body(shape, 0.0, Pose(np.array([0.0, 0.0, 0.008 + 0.01 - 0.0001])), friction)
    gravity = G * np.array([np.sin(slope), 0.0, -np.cos(slope)])
    solver = GraspSolver(fingers, body, LONG, gravity=gravity)
    pressed = solver.solve({}).require_converged()
    weight = sum(contact.force for contact in pressed.contacts) / np.cos(slope)
    solver.solve({}, mass=weight / G).require_converged()
    return solver
