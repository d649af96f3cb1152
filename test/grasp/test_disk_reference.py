# SPDX-License-Identifier: Apache-2.0
"""Fingers that press on each other, next to an optimiser that knows nothing of nearest points."""

from itertools import pairwise

import casadi as ca
import numpy as np
import pytest
from friction_cases import around

from ccr_ros.grasp.statics import DiskShape, GraspSolver, disk_distance, sphere_body
from ccr_ros.model import MountedFinger, Pose, SolverSettings

SHAPE = DiskShape(thickness=0.004)
FAR = sphere_body(0.01, pose=Pose(np.array([0.0, 0.0, 0.5])))  # nothing to grasp


def chain(finger, base):
    """Own kinematics of arcs of constant curvature: curvatures, disks' frames, centres, energy."""
    count, step = finger.segments, finger.length / finger.segments
    curvature = ca.SX.sym("k", 3, count)
    turn, place = ca.SX(base.rotation), ca.SX(base.position)
    turns, places = [turn], [place]
    for k in range(count):
        w = curvature[:, k] * step
        angle = ca.sqrt(ca.dot(w, w) + 1e-20)
        cross = ca.skew(w)
        sine, rest = ca.sin(angle) / angle, (1 - ca.cos(angle)) / angle**2
        place = place + turn @ (
            (ca.SX.eye(3) + rest * cross + (1 - sine) / angle**2 * cross @ cross)
            @ ca.SX([0, 0, step])
        )
        turn = turn @ (ca.SX.eye(3) + sine * cross + rest * cross @ cross)
        turns.append(turn)
        places.append(place)
    stiffness = finger.bending_stiffness * ca.DM([1, 1, finger.torsion_ratio])
    energy = 0.5 * step * ca.sum1(stiffness.T @ curvature**2 @ ca.DM.ones(count))
    return curvature, turns, places, energy


def test_against_an_optimiser_that_finds_the_plane_between_disks(monkeypatch):
    """IPOPT on own kinematics; disks are apart where a plane is between them, which it moves."""
    monkeypatch.setattr(disk_distance, "DOME", 1e-6)
    fingers, pulls = around(2, 0.028), (0.0056, 0.0040)
    aside = fingers[1].base.position + np.array([0.0, 0.006, 0.0])
    fingers[1] = MountedFinger(fingers[1].finger, Pose(aside, fingers[1].base.orientation))
    flat = SolverSettings(curvature_order=0, time_limit=60.0)
    solver = GraspSolver(fingers, FAR, flat, disks=SHAPE)
    solution = solver.solve(
        {name: [pull] for name, pull in zip(solver.names, pulls, strict=True)}
    ).require_converged()
    (contact,) = solution.disk_contacts
    way, energy, room, unknown = ca.SX.sym("way", 3), 0, [], []
    apart = -ca.SX(SHAPE.thickness)
    tips = []
    for mounted, pull, disk, sign in zip(fingers, pulls, contact.disks, (1, -1), strict=True):
        curvature, turns, places, own = chain(mounted.finger, mounted.base)
        unknown.append(ca.vec(curvature))
        energy += own * 1e3
        hole = ca.DM([mounted.finger.disk_radius, 0, 0])
        points = [p + t @ hole for p, t in zip(places, turns, strict=True)]
        cable = sum(ca.norm_2(b - a) for a, b in pairwise(points))
        room.append((mounted.finger.length - pull - cable) * 1e3)
        core = mounted.finger.disk_radius - SHAPE.thickness / 2
        axis = turns[disk][:, 2]
        apart -= sign * ca.dot(way, places[disk]) + core * ca.norm_2(ca.cross(way, axis))
        tips.append(places[-1])
    room = [*room, apart * 1e3, ca.dot(way, way)]
    x = ca.vertcat(*unknown, way)
    problem = {"x": x, "f": energy, "g": ca.vertcat(*room)}
    options = {"ipopt.print_level": 0, "print_time": 0, "ipopt.tol": 1e-8, "ipopt.sb": "yes"}
    optimiser = ca.nlpsol("reference", "ipopt", problem, options)
    # Which of the ways around each other is meant the first normal tells.
    start = np.concatenate([np.tile([0.0, 6.0, 0.0], 12), contact.normal])
    found = optimiser(x0=start, lbg=[0, 0, 0, 1], ubg=[np.inf, np.inf, np.inf, 1])
    assert optimiser.stats()["success"]
    assert solution.energy == pytest.approx(float(found["f"]) * 1e-3, rel=1e-5)
    for index, end in enumerate(ca.Function("tips", [x], tips)(found["x"])):
        tip = fingers[index].base.points(solution.fingers[index].backbone[-1])
        assert tip == pytest.approx(end.full().ravel(), abs=1e-7)
    assert contact.normal == pytest.approx(found["x"].full().ravel()[-3:], abs=1e-4)
    tensions = [float(f.tensions[0]) for f in solution.fingers]
    forces = -found["lam_g"].full().ravel()[:3]  # of mJ per mm
    assert [*tensions, contact.force] == pytest.approx(forces, rel=1e-4)
