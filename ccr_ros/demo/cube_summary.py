# SPDX-License-Identifier: Apache-2.0
"""What a recorded grasp of the cube amounts to, in a few lines for people."""

from __future__ import annotations

import math
from itertools import pairwise

from ccr_ros.viz.figures import force_unit
from ccr_ros.viz.recording import Frame, Recording

from .cube_scene import CUBE


def cube_lines(recording: Recording) -> list[str]:
    """Return a line for each phase, and what was reached in all.

    A phase's line has when it began, and at its end: how far the cube is turned, and the normal
    forces of the contacts; and the smallest friction margin in it.
    """
    unit = force_unit(recording.forces_are)
    begun = [*recording.phases, (recording.duration + 1e-9, "")]
    lines = []
    for (start, phase), (end, _) in pairwise(begun):
        frames = [f for f in recording.frames if start <= f.time < end]
        lines.append(
            f"{start:6.1f} s  {phase or '-':<12} {_state(recording, frames, unit)}".rstrip()
        )
    return [*lines, *_in_all(recording, unit)]


def _state(recording: Recording, frames: list[Frame], unit: str) -> str:
    if not frames:
        return ""
    words = []
    turned = _turned(recording, frames[-1])
    if turned is not None:
        words.append(f"turned {math.degrees(turned):+5.1f} deg")
    forces = _forces(frames[-1:])
    if forces:
        words.append(f"contacts press {_range(forces)} {unit}")
    margins = _margins(frames)
    if margins:
        words.append(f"margin {min(margins):.2f} or more")
    return ", ".join(words)


def _in_all(recording: Recording, unit: str) -> list[str]:
    carried = [f for f in recording.frames if f.grip is not None and f.grip.held]
    turns = [t for f in carried if (t := _turned(recording, f)) is not None]
    if not turns:
        return ["the fingers never carried the cube"]
    left, right = math.degrees(max(turns)), -math.degrees(min(turns))
    lines = [f"turned by up to {left:.1f} deg to the left and {right:.1f} deg to the right"]
    if margins := _margins(carried):
        at = next(f.time for f in carried if _margins([f]) == [min(margins)])
        lines.append(
            f"carried for {carried[-1].time - carried[0].time:.1f} s; smallest friction margin on"
            f" the way {min(margins):.2f} (at {at:.1f} s; it slips at 0)"
        )
    if forces := _forces(carried):
        lines.append(f"each contact pressed with {_range(forces)} {unit}")
    return lines


def _turned(recording: Recording, frame: Frame) -> float | None:
    """Turn about z [rad] since the fingers have carried it, before it was first turned."""
    turned = recording.turned(frame, CUBE.name)
    hung = [f for f in recording.frames if f.phase == "hold" and f.grip and f.grip.held]
    first = [f for f in hung if f.time < _first_turn(recording)]
    begin = recording.turned(first[-1], CUBE.name) if first else 0.0
    return None if turned is None else turned - (begin or 0.0)


def _first_turn(recording: Recording) -> float:
    return min((time for time, phase in recording.phases if "turn" in phase), default=math.inf)


def _forces(frames: list[Frame]) -> list[float]:
    return [c.force for f in frames if f.grip is not None for c in f.grip.contacts]


def _margins(frames: list[Frame]) -> list[float]:
    """The smallest margin in each frame in which the fingers carry the cube."""
    held = [f.grip for f in frames if f.grip is not None and f.grip.held]
    return [grip.margin for grip in held if grip.margin is not None]


def _range(values: list[float]) -> str:
    low, high = f"{min(values):.3g}", f"{max(values):.3g}"
    return low if low == high else f"{low} to {high}"
