# SPDX-License-Identifier: Apache-2.0
"""A recording as one picture: the gripper at some moments, and its measurements over time."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..model import checks
from .figures import MM, checked_path, force_unit, new_figure, save
from .palette import OBJECT
from .recording import FingerFrame, Frame, Recording
from .sketch import View, bounds, cable_color, draw_moment, draw_plate

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_DASHES: tuple[Any, ...] = ("-", (0, (5, 2)), (0, (1.5, 1.5)), (0, (6, 2, 1.5, 2)))


def write_strip(
    recording: Recording, path: str | Path, count: int = 5, phases: tuple[str, ...] = ()
) -> Path:
    """Draw the strip of a recording to a PNG (or SVG, PDF) file and return its path.

    Args:
        recording: The recording.
        path: The file; its directory must exist.
        count: Number of moments shown, 1..12; see `moments`.
        phases: Where given, the ends of these phases are shown instead.

    Raises:
        InvalidValue: A wrong count, or a path that does not end in a known picture format.
        InvalidFile: The file cannot be written.
        MissingMatplotlib: matplotlib is not installed.
    """
    out = checked_path(path)
    return save(figure_of_recording(recording, count, phases), out, dpi=120)


def moments(recording: Recording, count: int) -> tuple[int, ...]:
    """Return indices of at most ``count`` frames to show: first, last, and where most happens.

    They part the run into pieces of equal change, half of it time and half of it pulls, so that
    closing and opening are shown more finely than waiting.
    """
    checks.integer("count", count, low=1, high=12)
    frames = recording.frames
    if count == 1 or len(frames) == 1:
        return (0,)
    times = np.array([f.time for f in frames])
    change = np.array([0.0] + [_change(a, b) for a, b in pairwise(frames)])
    progress = (times - times[0]) / (times[-1] - times[0])
    if change.sum() > 0:
        progress = (progress + np.cumsum(change) / change.sum()) / 2
    marks = np.linspace(0, 1, count)
    return tuple(dict.fromkeys(int(np.argmin(np.abs(progress - m))) for m in marks))


def phase_ends(recording: Recording, phases: tuple[str, ...]) -> tuple[int, ...]:
    """Return the index of the last frame of the first phase of each of these names, in turn."""
    frames, ends = recording.frames, []
    for name in phases:
        own = [i for i, frame in enumerate(frames) if frame.phase == name]
        run = [i for k, i in enumerate(own) if i == own[0] + k]
        ends += run[-1:]
    return tuple(sorted(set(ends)))


def figure_of_recording(
    recording: Recording, count: int = 5, phases: tuple[str, ...] = ()
) -> Figure:
    """Return the figure that `write_strip` writes.

    Its axes are labelled "t=...", then "tension", "force" (where there is contact), "margin" (where
    an object is carried with friction), "turn" (where an object turns about z), "pull" and "servo"
    (where servo angles are known).
    """
    shown = phase_ends(recording, phases) or moments(recording, count)
    view = View()
    low, high = bounds(recording, view)
    middle, half = (low + high) / 2, (high - low) / 2 + 12.0  # mm of air, and room for force arrows
    width = max(10.0, 2.9 * len(shown))
    panel = 0.925 * width / len(shown) * half[1] / half[0]
    panel = min(max(panel, 2.0), 5.0)
    curves = _panels(recording)
    height = panel + 1.9 + 1.5 * len(curves)
    figure = new_figure(width, height)
    grid = figure.add_gridspec(
        1 + len(curves), len(shown), height_ratios=(panel, *(1.5 for _ in curves)), left=0.06,
        right=0.985, top=1 - 0.95 / height, bottom=0.85 / height, hspace=0.1, wspace=0.0,
    )  # fmt: skip
    figure.text(
        0.15 / width,
        1 - 0.36 / height,
        recording.gripper,
        fontsize=15,
        fontweight="bold",
        color="#18212e",
    )
    for column, index in enumerate(shown):
        frame = recording.frames[index]
        axes = figure.add_subplot(grid[0, column], label=f"t={frame.time:.2f}")
        draw_plate(axes, recording, view)
        draw_moment(axes, recording, frame, view)
        axes.set_aspect("equal", adjustable="box", anchor="S")
        axes.set_xlim(middle[0] - half[0], middle[0] + half[0])
        axes.set_ylim(middle[1] - half[1], middle[1] + half[1])
        axes.set_axis_off()
        phase = f", {frame.phase}" if phases and frame.phase else ""
        title = f"{frame.time:.1f} s{phase}\n{_state(frame)}"
        axes.set_title(title, fontsize=10, color="#18212e")
    first: Any = None
    for row, (label, title, value) in enumerate(curves, 1):
        axes = figure.add_subplot(grid[row, :], label=label, sharex=first)
        if isinstance(value, str):
            _turn(axes, recording, value)
            _marks(axes, recording, shown, title)
        else:
            per_cable = label not in ("force", "margin")
            _curves(axes, recording, shown, value, title, per_cable=per_cable)
        axes.tick_params(labelbottom=row == len(curves))
        first = first or axes
    axes.set_xlabel("time [s]", fontsize=9)
    _name_phases(first, recording)
    handles, labels = first.get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="lower center", ncols=min(6, len(labels)), fontsize=9, frameon=False
    )
    return figure


def _change(a: Frame, b: Frame) -> float:
    """How much the pulls changed [m], summed over fingers that are in both frames."""
    names = a.fingers.keys() & b.fingers.keys()
    return float(sum(np.abs(b.fingers[n].pulls - a.fingers[n].pulls).sum() for n in names))


def _state(frame: Frame) -> str:
    contacts = sum(len(f.contacts) for f in frame.fingers.values())
    bad = [n for n, f in frame.fingers.items() if not f.converged or f.stale]
    words = [f"{contacts} contact{'' if contacts == 1 else 's'}" if contacts else "no contact"]
    words += [f"not converged: {', '.join(bad)}"] if bad else []
    return ", ".join(words)


# Of a finger of this name and its cable in a frame; or the name of an object that turns.
_Value = Callable[[Frame, str, int], "float | None"] | str


def _panels(recording: Recording) -> list[tuple[str, str, _Value]]:
    """What is drawn over time: label, title, and the value of a finger's cable in a frame."""
    unit = force_unit(recording.forces_are)
    moments = [f for frame in recording.frames for f in frame.fingers.values()]
    panels: list[tuple[str, str, _Value]] = [
        ("tension", f"tension [{unit}]", _own(lambda f, j: float(f.tensions[j])))
    ]
    if any(f.contacts for f in moments):
        title = f"contact force\nper finger [{unit}]"
        panels.append(("force", title, _own(lambda f, _: sum(c.force for c in f.contacts))))
    if any(f.grip is not None and f.grip.held for f in recording.frames):
        panels.append(("margin", "friction margin\nwhile carried", _margin))
    for body in recording.objects:
        turns = [recording.turned(frame, body.name) for frame in recording.frames]
        if any(t is not None and abs(t) > math.radians(1.0) for t in turns):
            panels.append(("turn", f"turn of\n{body.name} [deg]", body.name))
    panels.append(("pull", "pull [mm]", _own(lambda f, j: float(f.pulls[j]) * MM)))
    if any(f.servo_angles is not None for f in moments):
        panels.append(("servo", "servo [deg]", _own(_servo_degrees)))
    return panels


def _own(
    value: Callable[[FingerFrame, int], float | None],
) -> Callable[[Frame, str, int], float | None]:
    """What depends on the finger alone."""
    return lambda frame, name, cable: value(frame.fingers[name], cable)


def _margin(frame: Frame, name: str, _: int) -> float | None:
    return frame.grip.margin_of(name) if frame.grip is not None and frame.grip.held else None


def _servo_degrees(frame: FingerFrame, cable: int) -> float | None:
    angles = frame.servo_angles
    return None if angles is None else math.degrees(angles[cable])


def _name_phases(axes: Any, recording: Recording) -> None:
    """Write what the gripper is doing above the curves, where there is room for it."""
    begun = [*recording.phases, (recording.duration, "")]
    for (time, phase), (end, _) in pairwise(begun):
        if end - time > 0.011 * len(phase) * recording.duration:
            axes.annotate(
                phase, (time, 1.0), xycoords=("data", "axes fraction"), xytext=(3, 2),
                textcoords="offset points", fontsize=8, color="#4a5568",
            )  # fmt: skip


def _curves(
    axes: Any,
    recording: Recording,
    shown: tuple[int, ...],
    value: Callable[[Frame, str, int], float | None],
    label: str,
    per_cable: bool,
) -> None:
    fingers, last = recording.fingers, len(recording.fingers) - 1
    for k, finger in enumerate(fingers):
        frames = [f for f in recording.frames if finger.name in f.fingers]
        times = [f.time for f in frames]
        for j, cable in enumerate(finger.cables if per_cable else finger.cables[:1]):
            values = [value(f, finger.name, j) for f in frames]
            axes.plot(
                times,
                [math.nan if v is None else v for v in values],
                color=cable_color(k, j, len(fingers)),
                ls=_DASHES[j % len(_DASHES)] if last else "-",
                # Fingers often do the same: the first drawn are the widest, so that all show.
                lw=1.2 + (1.6 * (last - k) if last < 4 else 0),
                label=f"{finger.name} {cable}",
            )
    _marks(axes, recording, shown, label)


def _turn(axes: Any, recording: Recording, name: str) -> None:
    """Draw by how much an object has turned about z."""
    turns = [recording.turned(frame, name) for frame in recording.frames]
    degrees = [math.nan if t is None else math.degrees(t) for t in turns]
    axes.plot([f.time for f in recording.frames], degrees, color=OBJECT, lw=2.0)


def _marks(axes: Any, recording: Recording, shown: tuple[int, ...], label: str) -> None:
    """Mark phases and the moments shown; name the axis, and dress it."""
    for time, _ in recording.phases[1:]:
        axes.axvline(time, color="#4a5568", lw=0.7, alpha=0.35)
    for index in shown:
        axes.axvline(
            recording.frames[index].time, color="#18212e", lw=0.8, ls=(0, (2, 2)), alpha=0.5
        )
    if len(recording.frames) > 1:
        axes.set_xlim(recording.frames[0].time, recording.duration)
    axes.set_ylabel(label, fontsize=9)
    axes.grid(color="#e3e7ee", linewidth=0.7)
    axes.tick_params(labelsize=8, colors="#4a5568")
    for side, edge in axes.spines.items():
        edge.set_color("#c5ccd6")
        edge.set_visible(side in ("left", "bottom"))
