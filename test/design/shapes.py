# SPDX-License-Identifier: Apache-2.0
"""Wanted shapes that the tests of rest shapes share."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

from ccr_ros.design.curve_text import curve_from_text
from ccr_ros.design.placement import place
from ccr_ros.design.target import DesiredShape
from ccr_ros.model import Finger
from ccr_ros.model.rotation import skew

SPHERE = "sphere:0.112,x=0.042,z=0.110"  # the paper's, for a base 42 mm from the axis


def on_curve(text: str, finger: Finger) -> DesiredShape:
    """The finger's disks on a curve as the command line takes it."""
    return place(curve_from_text(text, finger), finger)


def wandering_shape(finger: Finger, seed: int, bend: float = 8.0) -> DesiredShape:
    """Disk centres and tangents on a random smooth curve in space, integrated as an ODE.

    Args:
        finger: Whose disks they are.
        seed: Of the curve.
        bend: Standard deviation [1/m] of the amplitudes of its bending's first Fourier terms.
    """
    amplitudes = np.random.default_rng(seed).normal(size=(4, 2)) * bend
    amplitudes *= np.array([1.0, 1.0, 0.7, 0.4])[:, None]

    def slope(s: float, x: np.ndarray) -> np.ndarray:
        waves = np.cos(np.arange(4) * np.pi * s / finger.length)
        frame = x[3:].reshape(3, 3)
        turning = frame @ skew(np.array([*(waves @ amplitudes), 0.0]))
        return np.concatenate([frame[:, 2], turning.ravel()])

    s = np.linspace(0.0, finger.length, finger.segments + 1)
    start = np.concatenate([np.zeros(3), np.eye(3).ravel()])
    states = solve_ivp(slope, (0, s[-1]), start, t_eval=s, rtol=1e-12, atol=1e-13).y.T
    tangents = states[:, 3:].reshape(-1, 3, 3)[:, :, 2]
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    return DesiredShape(states[:, :3], tangents=tangents)
