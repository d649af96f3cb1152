# SPDX-License-Identifier: Apache-2.0
"""The pose that pulls bring a finger to, the points it was to reach, and the path of its tip."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..model.solution import Solution
from . import palette
from .figures import MM, checked_path, new_figure, save
from .plots import draw_legend, draw_title, draw_views

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_FEW = 40  # points; more are drawn as a line


def plot_pulls(
    path: str | Path,
    solution: Solution,
    wanted: np.ndarray,
    *,
    rest: Solution | None = None,
    track: np.ndarray | None = None,
) -> Path:
    """Draw a pose and its target to a PNG (or SVG, PDF) file and return its path.

    Args:
        path: The file; its directory must exist.
        solution: The pose, of a path the last one.
        wanted: (k, 3) points that were to be reached [m], k >= 0.
        rest: The pose without pulls and obstacles, drawn in grey.
        track: (k, 3) where the tip was along a path [m].

    Raises:
        InvalidValue, InvalidFile, MissingMatplotlib: As `plots.plot_solution`.
    """
    out = checked_path(path)
    return save(figure_of_pulls(solution, wanted, rest=rest, track=track), out)


def figure_of_pulls(
    solution: Solution,
    wanted: np.ndarray,
    *,
    rest: Solution | None = None,
    track: np.ndarray | None = None,
) -> Figure:
    """Return the figure that `plot_pulls` writes; axes "3-D", "x-z" and "y-z" (their labels)."""
    figure = new_figure(14.0, 6.8)
    grid = figure.add_gridspec(
        1, 3, width_ratios=(1.3, 1, 1), left=0.01, right=0.985, top=0.84, bottom=0.145, wspace=0.2
    )
    also = [wanted] + ([] if track is None else [track])
    views = draw_views(figure, [grid[0, i] for i in range(3)], solution, rest=rest, also=also)
    for axes, keep in zip(views, ([0, 1, 2], [0, 2], [1, 2]), strict=True):
        if len(wanted) > _FEW:
            axes.plot(
                *(wanted[:, keep].T * MM), color=palette.WANTED, lw=6, alpha=0.35, zorder=2.5,
                label="wanted", solid_capstyle="round",
            )  # fmt: skip
        elif len(wanted):
            axes.plot(
                *(wanted[:, keep].T * MM), lw=0, marker="o", ms=9, mfc="none",
                mec=palette.WANTED, mew=1.6, zorder=6.5, label="wanted",
            )  # fmt: skip
        if track is not None:
            axes.plot(
                *(track[:, keep].T * MM), color=palette.BACKBONE, lw=1.0, zorder=6.4,
                label="path of the tip",
            )  # fmt: skip
    draw_title(figure, solution)
    draw_legend(figure, views[1])
    return figure
