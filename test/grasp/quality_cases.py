# SPDX-License-Identifier: Apache-2.0
"""Contacts with known answers."""

from dataclasses import replace

import numpy as np

from ccr_ros.grasp.quality import FrictionContact
from ccr_ros.model import Pose

CENTRE = np.zeros(3)
ANGLES = np.arange(3) * 2 * np.pi / 3
EQUATOR = np.column_stack([np.cos(ANGLES), np.sin(ANGLES), np.zeros(3)])
OCTAHEDRON = np.concatenate([np.eye(3), -np.eye(3)])
PINCH = OCTAHEDRON[[0, 3]]


def on_ball(points, friction, **given):
    """Contacts on a ball of radius 1 m about the origin."""
    return [FrictionContact(p, p, friction, **given) for p in np.asarray(points, float)]


def scattered(rng, count, friction):
    """Contacts at random places, with random normals that lean outwards."""
    points = rng.standard_normal((count, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    normals = points + 0.4 * rng.standard_normal((count, 3))
    return [FrictionContact(p, n, friction) for p, n in zip(points, normals, strict=True)]


def moved(contacts, pose: Pose):
    return [
        replace(
            c,
            position=pose.points(c.position),
            normal=pose.vectors(c.normal),
            friction_force=pose.vectors(c.friction_force),
        )
        for c in contacts
    ]


def fixture():
    """A cube of 2 m on 3-2-1 frictionless points, clamped at a chamfered corner: seven contacts.

    The clamp pushes along (-1, -1, -1) through (0.2, 0.1, -0.1); every point then carries load.
    """
    below = [[-0.8, -0.8, -1], [0.8, -0.8, -1], [0, 0.8, -1]]
    beside = [[-1, -0.8, -0.2], [-1, 0.8, -0.2]]
    behind = [[0, -1, -0.3]]
    clamp = np.array([0.2, 0.1, -0.1]) + 0.8
    normals = [[0, 0, -1]] * 3 + [[-1, 0, 0]] * 2 + [[0, -1, 0]]
    contacts = [
        FrictionContact(p, n, 0.0) for p, n in zip(below + beside + behind, normals, strict=True)
    ]
    return [*contacts, FrictionContact(clamp, [1.0, 1.0, 1.0], 0.0)]
