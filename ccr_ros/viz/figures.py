# SPDX-License-Identifier: Apache-2.0
"""What plots and strips share: matplotlib on demand, 3-D axes of equal scale, bodies, saving."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..model.errors import CcrError, InvalidFile, InvalidValue
from . import palette
from .shapes import Surface

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MM = 1e3  # drawings are for people: millimetres
SUFFIXES = (".png", ".svg", ".pdf")


class MissingMatplotlib(CcrError):
    """Drawing was asked for, and matplotlib, an optional dependency, is not installed."""

    def __init__(self) -> None:
        super().__init__(
            "drawing needs matplotlib, which is not installed: install it (pip install matplotlib,"
            " or this package with its extra 'plot')"
        )


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure of that size [inch], apart from pyplot's global state.

    Raises:
        MissingMatplotlib: matplotlib is not installed.
    """
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError:
        raise MissingMatplotlib from None
    figure = Figure(figsize=(width, height), facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def checked_path(path: str | Path) -> Path:
    """Return the path if a figure could be written there; called before any work is done.

    Raises:
        InvalidValue: Its suffix is no picture format.
        InvalidFile: It is a directory, or its directory does not exist.
    """
    out = Path(path)
    if out.suffix.lower() not in SUFFIXES:
        raise InvalidValue("plot file", str(path), f"a name that ends in {', '.join(SUFFIXES)}")
    if out.is_dir():
        raise InvalidFile(path, "cannot be written: is a directory")
    if not out.parent.is_dir():
        raise InvalidFile(path, f"cannot be written: there is no directory {str(out.parent)!r}")
    return out


def save(figure: Figure, path: Path, dpi: int = 150) -> Path:
    """Write a figure to a file.

    Raises:
        InvalidFile: The file cannot be written.
    """
    try:
        figure.savefig(path, dpi=dpi)
    except OSError as error:
        raise InvalidFile(path, f"cannot be written: {error.strerror or error}") from None
    return path


def force_unit(forces_are: str) -> str:
    """Return the unit to print after forces."""
    return "N" if forces_are == "newton" else "1/m² per EI"


def draw_surface(axes: Any, surface: Surface, label: str = "") -> None:
    """Draw a body, in 3-D axes scaled in mm, lit from above."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    faces = [face * MM for face in surface.faces]
    light = np.array([0.35, -0.45, 0.82])
    center = surface.vertices.mean(axis=0) * MM
    base = np.array([int(palette.OBSTACLE[i : i + 2], 16) / 255 for i in (1, 3, 5)])
    colors = []
    for face in faces:
        normal = np.cross(face[2] - face[0], face[3 if len(face) > 3 else 1] - face[1])
        normal /= np.linalg.norm(normal) or 1.0
        if normal @ (face.mean(axis=0) - center) < 0:
            normal = -normal
        colors.append((*np.clip(base * (0.85 + 0.35 * (normal @ light)), 0, 1), 0.22))
    # As many corners for each, the last one repeated: for shorter ones Matplotlib (3.11) keeps
    # corners that it has not set, and takes the axes' limits of them, too.
    most = max(len(face) for face in faces)
    alike = [
        np.concatenate([face, np.repeat(face[-1:], most - len(face), axis=0)]) for face in faces
    ]
    axes.add_collection3d(
        Poly3DCollection(
            alike, facecolors=colors, edgecolors=[(*base, 0.10)], linewidths=0.3, label=label
        )
    )


def equal_limits(axes: Any, points: np.ndarray, margin: float = 0.04) -> None:
    """Give 3-D axes [mm] limits that hold points (p, 3) [m], with the same scale on every axis."""
    low, high = points.min(axis=0) * MM, points.max(axis=0) * MM
    middle, half = (low + high) / 2, (high - low) / 2
    half = np.maximum(half, 0.3 * half.max()) * (1 + 2 * margin)
    axes.set_xlim(middle[0] - half[0], middle[0] + half[0])
    axes.set_ylim(middle[1] - half[1], middle[1] + half[1])
    axes.set_zlim(middle[2] - half[2], middle[2] + half[2])
    axes.set_box_aspect(half, zoom=0.98)


def plain_3d(axes: Any) -> None:
    """Quieten the panes and the grid of 3-D axes, and keep their labels apart."""
    from matplotlib.ticker import MaxNLocator

    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_major_locator(MaxNLocator(4 if axis is not axes.zaxis else 8))
        axis.set_pane_color((0.97, 0.975, 0.985, 1.0))
        axis._axinfo["grid"].update(color=(0.86, 0.88, 0.91, 1.0), linewidth=0.6)
        axis.line.set_color((0.7, 0.73, 0.78, 1.0))
    axes.tick_params(labelsize=8, colors="#4a5568")
