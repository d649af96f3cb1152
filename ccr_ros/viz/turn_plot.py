# SPDX-License-Identifier: Apache-2.0
"""A turn in hand: pulls, contact forces and friction margins against the angle."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..design.turn import TurnRecord, TurnResult
from . import palette
from .figures import MM, checked_path, new_figure, save
from .plots import plain_2d

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plot_turn(path: str | Path, name: str, record: TurnRecord, result: TurnResult) -> Path:
    """Draw a turn to a PNG (or SVG, PDF) file and return its path.

    Args:
        path: The file; its directory must exist.
        name: Of the gripper.
        record: The turn, step by step.
        result: What it is a record of.

    Raises:
        InvalidValue, InvalidFile, MissingMatplotlib: As `plots.plot_solution`.
    """
    out = checked_path(path)
    return save(figure_of_turn(name, record, result), out)


def figure_of_turn(name: str, record: TurnRecord, result: TurnResult) -> Figure:
    """Return the figure that `plot_turn` writes; axes "pulls", "forces" and "margins"."""
    figure = new_figure(13.5, 5.4)
    grid = figure.add_gridspec(1, 3, left=0.05, right=0.985, top=0.78, bottom=0.22, wspace=0.2)
    degrees = np.rad2deg(record.angles)
    owner = [cable.rpartition(".")[0] for cable in record.cables]
    lines = ("-", (0, (5, 2)), (0, (1.5, 1.5)))

    def panel(cell: int, label: str, title: str) -> Any:
        axes = figure.add_subplot(grid[0, cell], label=label)
        axes.set_title(title, fontsize=10, color="#4a5568")
        axes.set_xlabel("turn about z [deg]", fontsize=9)
        axes.axvline(0, color="#b6bfcb", lw=0.8)
        plain_2d(axes)
        return axes

    pulls = panel(0, "pulls", "pulls [mm]")
    for j, cable in enumerate(record.cables):
        dash: Any = lines[owner[:j].count(owner[j]) % len(lines)]
        color = palette.color(record.fingers.index(owner[j]))
        pulls.plot(degrees, record.pulls[:, j] * MM, color=color, ls=dash, lw=1.8, label=cable)
    forces = panel(1, "forces", "normal forces [N]")
    margins = panel(2, "margins", "friction margins")
    for k, finger in enumerate(record.fingers):
        style: dict[str, Any] = {"color": palette.color(k), "marker": ".", "ms": 4}
        style |= {"lw": 1.8, "label": finger}
        forces.plot(degrees, record.forces[:, k], **style)
        margins.plot(degrees, record.margins[:, k], **style)
    forces.set_ylim(bottom=0)
    margins.set_ylim(0, 1)
    for axes in (pulls, forces, margins):
        axes.legend(
            loc="upper center", bbox_to_anchor=(0.5, -0.15), ncols=2, fontsize=8.5, frameon=False
        )
    figure.text(0.02, 0.93, name, fontsize=15, fontweight="bold", color="#18212e")
    ends = "; ".join(
        f"{np.rad2deg(way.plan.moved[5]):+.1f} deg: {way.limiting or 'no further asked for'}"
        for way in result.ways
    )
    figure.text(0.02, 0.875, ends, fontsize=9.5, color="#4a5568")
    return figure
