# SPDX-License-Identifier: Apache-2.0
"""What a recorded grasp amounts to, in a few lines for people."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ccr_ros.viz.figures import force_unit
from ccr_ros.viz.recording import Frame, Recording

from .scene import BALL


def phase_lines(recording: Recording) -> list[str]:
    """Return a line for each phase: when it began, and grip, tensions and ball at its end.

    The grip is the sum of a finger's contact forces: least and most of all fingers in the last
    half second of the phase.
    """
    unit = force_unit(recording.forces_are)
    begun = [*recording.phases, (recording.duration + 1e-9, "")]
    lines = []
    for (start, phase), (end, _) in pairwise(begun):
        frames = [f for f in recording.frames if max(start, end - 0.5) <= f.time < end]
        text = f"{start:6.1f} s  {phase or '-':<24}"
        if frames:
            text += f" {_state(frames, unit)}"
        lines.append(text.rstrip())
    return lines


def _state(frames: list[Frame], unit: str) -> str:
    forces = [
        sum(contact.force for contact in finger.contacts)
        for frame in frames
        for finger in frame.fingers.values()
    ]
    tensions = [float(f.tensions.max()) for f in frames[-1].fingers.values()]
    words = [f"tension {_range(tensions)} {unit}"]
    if max(forces) > 0:
        words.insert(0, f"grip {_range(forces)} {unit}")
    ball = (frames[-1].objects or {}).get(BALL.name)
    if ball is not None:
        words.append(f"ball at {ball.position[2] * 1e3:.2f} mm")
    return ", ".join(words)


def _range(values: list[float]) -> str:
    low, high = f"{np.min(values):.3g}", f"{np.max(values):.3g}"
    return low if low == high else f"{low} to {high}"
