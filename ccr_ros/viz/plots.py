# SPDX-License-Identifier: Apache-2.0
"""A solved pose as a picture: one 3-D view and two side views, in millimetres."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..model.solution import Solution
from . import palette
from .figures import (
    MM,
    checked_path,
    draw_surface,
    equal_limits,
    force_unit,
    new_figure,
    plain_3d,
    save,
)
from .shapes import Surface, circle, obstacle_surface

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SIDES = ((0, 2), (1, 2))  # x-z and y-z
_NAMES = "xyz"


def plot_solution(solution: Solution, path: str | Path, *, rest: Solution | None = None) -> Path:
    """Draw a solution to a PNG (or SVG, PDF) file and return its path.

    Args:
        solution: The pose; its finger's obstacles are drawn too.
        path: The file; its directory must exist.
        rest: The pose without pulls and obstacles, drawn in grey.

    Raises:
        InvalidValue: The path does not end in a known picture format.
        InvalidFile: The file cannot be written.
        MissingMatplotlib: matplotlib is not installed.
    """
    out = checked_path(path)
    return save(figure_of_solution(solution, rest=rest), out)


def figure_of_solution(solution: Solution, *, rest: Solution | None = None) -> Figure:
    """Return the figure that `plot_solution` writes; axes "3-D", "x-z" and "y-z" (their labels)."""
    figure = new_figure(14.0, 6.8)
    grid = figure.add_gridspec(
        1, 3, width_ratios=(1.3, 1, 1), left=0.01, right=0.985, top=0.84, bottom=0.145, wspace=0.2
    )
    views = draw_views(figure, [grid[0, i] for i in range(3)], solution, rest=rest)
    draw_title(figure, solution)
    draw_legend(figure, views[1])
    return figure


def draw_views(
    figure: Figure,
    cells: Sequence[Any],
    solution: Solution,
    *,
    rest: Solution | None = None,
    also: Sequence[np.ndarray] = (),
) -> list[Any]:
    """Draw a solution's three views into three cells of a grid, and return their axes.

    Args:
        figure: The figure.
        cells: Cells of one of its grids: of the 3-D view, of x-z and of y-z.
        solution: The pose.
        rest: The pose without pulls and obstacles, drawn in grey.
        also: Further points (k, 3) [m] that the views must show; not drawn here.
    """
    finger = solution.finger
    bodies = [
        obstacle_surface(o, solution.backbone.mean(axis=0), 0.9 * finger.length)
        for o in finger.obstacles
    ]
    arrows = _arrows(solution)
    held = [solution.centerline, *_disks(solution), *arrows, *also]
    held += [rest.centerline] if rest is not None else []
    held += [b.vertices for b in bodies]
    points = np.vstack(held)

    space: Any = figure.add_subplot(cells[0], projection="3d", label="3-D", computed_zorder=False)
    for body in bodies:
        draw_surface(space, body)
    _draw_pose(space, solution, rest, (0, 1, 2), arrows)
    plain_3d(space)
    equal_limits(space, points)
    space.view_init(elev=18, azim=-58)
    space.set_xlabel("x [mm]", fontsize=9)
    space.set_ylabel("y [mm]", fontsize=9)
    space.set_zlabel("z [mm]", fontsize=9, labelpad=8)

    low, high = points.min(axis=0) * MM, points.max(axis=0) * MM
    half = max((high - low)[:2].max() / 2, 0.28 * (high - low)[2]) * 1.06
    views = [space]
    for cell, (a, b) in zip(cells[1:], _SIDES, strict=True):
        side = figure.add_subplot(cell, label=f"{_NAMES[a]}-{_NAMES[b]}")
        for body in bodies:
            _draw_outline(side, body, (a, b))
        _draw_pose(side, solution, rest, (a, b), arrows)
        side.set_aspect("equal", adjustable="box")
        middle = (low[a] + high[a]) / 2
        side.set_xlim(middle - half, middle + half)
        pad = 0.03 * (high[2] - low[2])
        side.set_ylim(low[2] - pad, high[2] + pad)
        side.set_xlabel(f"{_NAMES[a]} [mm]", fontsize=9)
        side.set_ylabel(f"{_NAMES[b]} [mm]", fontsize=9)
        plain_2d(side)
        views.append(side)
    return views


def plain_2d(axes: Any) -> None:
    """Quieten the grid, the ticks and the frame of flat axes."""
    axes.grid(color="#e3e7ee", linewidth=0.7)
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=8, colors="#4a5568")
    for edge in axes.spines.values():
        edge.set_color("#c5ccd6")


def _draw_pose(
    axes: Any,
    solution: Solution,
    rest: Solution | None,
    keep: tuple[int, ...],
    arrows: list[np.ndarray],
) -> None:
    """Draw all lines in axes that show the coordinates ``keep``."""

    def line(points: np.ndarray, **style: Any) -> None:
        axes.plot(*(points[:, list(keep)].T * MM), **style)

    finger, unit = solution.finger, force_unit(solution.finger.forces_are)
    if rest is not None:
        line(
            rest.centerline,
            color=palette.REST,
            lw=2.0,
            ls=(0, (4, 2)),
            label="rest shape",
            zorder=2,
        )
        line(rest.backbone, color=palette.REST, lw=0, marker="o", ms=2.5, zorder=2)
    for disk in _disks(solution):
        line(disk, color=palette.DISK, lw=1.0, alpha=0.9, zorder=3)
    line(
        solution.centerline,
        color=palette.BACKBONE,
        lw=2.6,
        label="backbone",
        zorder=4,
        solid_capstyle="round",
    )
    for j, (name, tension) in enumerate(zip(finger.cable_names, solution.tensions, strict=True)):
        taut = tension > 0
        text = f"{name}: {tension:.4g} {unit}" if taut else f"{name}: slack"
        style = {"lw": 1.8} if taut else {"lw": 1.2, "ls": (0, (3, 2))}
        line(
            solution.cables[name], color=palette.color(j), label=f"cable {text}", zorder=5, **style
        )
    for i, (contact, arrow) in enumerate(zip(solution.contacts, arrows, strict=True)):
        strongest = max(c.force for c in solution.contacts)
        label = (
            f"contact, force on the finger (longest: {strongest:.3g} {unit})" if i == 0 else None
        )
        line(arrow, color=palette.CONTACT, lw=1.8, zorder=6, label=label)
        line(
            contact.position[None],
            color=palette.CONTACT,
            marker="o",
            ms=5,
            mec="white",
            mew=0.8,
            zorder=7,
        )
        _head(line, arrow)


def _head(line: Any, arrow: np.ndarray) -> None:
    """Draw an arrow's head as two barbs in the arrow's own plane nearest to the x-z plane."""
    shaft = arrow[1] - arrow[0]
    size = float(np.linalg.norm(shaft))
    if size <= 0:
        return
    across = np.cross(shaft, [0.0, 1.0, 0.0])
    across = across if np.linalg.norm(across) > 0.2 * size else np.cross(shaft, [1.0, 0.0, 0.0])
    across *= 0.12 * size / np.linalg.norm(across)
    foot = arrow[0] + 0.72 * shaft
    barbs = np.array([foot + across, arrow[1], foot - across])
    line(barbs, color=palette.CONTACT, lw=1.8, zorder=6)


def _disks(solution: Solution) -> list[np.ndarray]:
    """Rims (k, 3) of all disks."""
    r = solution.finger.disk_radius
    return [
        circle(x, frame[:, 0], frame[:, 1], r)
        for x, frame in zip(solution.backbone, solution.frames, strict=True)
    ]


def _arrows(solution: Solution) -> list[np.ndarray]:
    """Force arrows (2, 3), foot and head; the strongest a sixth of the finger's length."""
    strongest = max((c.force for c in solution.contacts), default=0.0)
    longest = solution.finger.length / 6
    return [
        np.array(
            [
                c.position,
                c.position + c.normal * (longest * c.force / strongest if strongest else 0.0),
            ]
        )
        for c in solution.contacts
    ]


def _draw_outline(axes: Any, body: Surface, keep: tuple[int, int]) -> None:
    from matplotlib.patches import Polygon

    corners = body.outline(keep) * MM
    style = {"edgecolor": palette.OBSTACLE, "linewidth": 1.2, "zorder": 1}
    axes.add_patch(Polygon(corners, closed=True, facecolor="#dfe5ee", **style))


def draw_title(figure: Figure, solution: Solution) -> None:
    """Write the finger's name, its pulls, and whether the pose is to be trusted."""
    finger, c = solution.finger, solution.certificate
    pulls = ", ".join(
        f"{name} {pull * MM:.3g} mm"
        for name, pull in zip(finger.cable_names, solution.pulls, strict=True)
    )
    figure.text(0.02, 0.945, finger.name, fontsize=15, fontweight="bold", color="#18212e")
    figure.text(0.02, 0.905, f"pulls: {pulls}", fontsize=10.5, color="#4a5568")
    good = c.converged and c.stable and not c.branch_jump
    words = ["converged" if c.converged else "NOT CONVERGED", "stable" if c.stable else "UNSTABLE"]
    words += ["jumped to another branch"] if c.branch_jump else []
    state = ", ".join(words) + (f" - {c.message}" if c.message else "")
    color = "#13805a" if good else palette.CONTACT
    figure.text(
        0.02, 0.868, state, fontsize=10.5, color=color, fontweight="normal" if good else "bold"
    )


def draw_legend(figure: Figure, axes: Any) -> None:
    """Write the legend of one view below all of them."""
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="lower center", ncols=min(5, len(labels)), fontsize=9, frameon=False,
        bbox_to_anchor=(0.5, 0.01),
    )  # fmt: skip
