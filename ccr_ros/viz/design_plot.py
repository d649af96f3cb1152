# SPDX-License-Identifier: Apache-2.0
"""What a design reaches: wanted, rest and actuated shape in three views, and each disk's error."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..design.target import DesiredShape
from ..model.solution import Solution
from . import palette
from .figures import MM, checked_path, new_figure, save
from .plots import draw_legend, draw_title, draw_views, plain_2d
from .shapes import smooth

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SMALLEST = 1e-10  # mm; errors below are drawn as this


def plot_design(
    path: str | Path,
    solution: Solution,
    wanted: DesiredShape,
    *,
    rest: Solution | None = None,
    curve: np.ndarray | None = None,
) -> Path:
    """Draw a design to a PNG (or SVG, PDF) file and return its path.

    Args:
        path: The file; its directory must exist.
        solution: The actuated pose, as the forward model has it.
        wanted: The wanted shape.
        rest: The pose without pulls and obstacles, drawn in grey.
        curve: Points (k, 3) [m] of the wanted curve, close together; ``None``: one that is smooth
            through the wanted disk centres.

    Raises:
        InvalidValue, InvalidFile, MissingMatplotlib: As `plots.plot_solution`.
    """
    out = checked_path(path)
    return save(figure_of_design(solution, wanted, rest=rest, curve=curve), out)


def figure_of_design(
    solution: Solution,
    wanted: DesiredShape,
    *,
    rest: Solution | None = None,
    curve: np.ndarray | None = None,
) -> Figure:
    """Return the figure that `plot_design` writes; axes "3-D", "x-z", "y-z" and "error"."""
    figure = new_figure(16.5, 6.8)
    grid = figure.add_gridspec(
        1, 4, width_ratios=(1.3, 1, 1, 0.8), left=0.01, right=0.985, top=0.84, bottom=0.145,
        wspace=0.28,
    )  # fmt: skip
    if curve is None:
        curve = _through(wanted)
    cells = [grid[0, i] for i in range(3)]
    views = draw_views(figure, cells, solution, rest=rest, also=[curve, wanted.points])
    for axes, keep in zip(views, ([0, 1, 2], [0, 2], [1, 2]), strict=True):
        _draw_wanted(axes, curve[:, keep] * MM, wanted.points[:, keep] * MM)
    _draw_errors(figure.add_subplot(grid[0, 3], label="error"), wanted.errors(solution.backbone))
    draw_title(figure, solution)
    draw_legend(figure, views[1])
    return figure


def _through(wanted: DesiredShape) -> np.ndarray:
    """A smooth curve through the wanted disk centres."""
    tangents = wanted.tangents
    if tangents is None:
        tangents = np.gradient(wanted.points, axis=0)
        tangents /= np.maximum(np.linalg.norm(tangents, axis=1, keepdims=True), 1e-12)
    return smooth(wanted.points, tangents, pieces=8)


def _draw_wanted(axes: Any, curve: np.ndarray, points: np.ndarray) -> None:
    """A broad band below the backbone, and rings where the disks' centres shall be."""
    axes.plot(
        *curve.T, color=palette.WANTED, lw=7, alpha=0.35, zorder=2.5, label="wanted",
        solid_capstyle="round",
    )  # fmt: skip
    axes.plot(
        *points.T, lw=0, marker="o", ms=6, mfc="none", mec=palette.WANTED, mew=1.2, zorder=6.5
    )


def _draw_errors(axes: Any, errors: np.ndarray) -> None:
    from matplotlib.ticker import MaxNLocator

    shown = np.maximum(errors[1:] * MM, _SMALLEST)
    below = f"\n(less than {_SMALLEST:g} is drawn as that)" if shown.min() == _SMALLEST else ""
    disks = np.arange(1, len(errors))
    low = 10.0 ** np.floor(np.log10(shown.min()) - 0.5)
    axes.vlines(disks, low, shown, color=palette.WANTED, lw=2, alpha=0.6)
    axes.plot(disks, shown, lw=0, marker="o", ms=5, color=palette.WANTED)
    axes.set_yscale("log")
    axes.set_ylim(low, 10.0 ** np.ceil(np.log10(shown.max()) + 0.3))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("disk", fontsize=9)
    total = float(np.sum((errors * MM) ** 2))
    axes.set_title(
        f"distance from wanted centre [mm]\nsum of squares {total:.2g} mm²{below}",
        fontsize=9.5,
        color="#4a5568",
    )
    plain_2d(axes)
