# SPDX-License-Identifier: Apache-2.0
"""Triangles out of STL files."""

from __future__ import annotations

import io
from functools import partial
from pathlib import Path

import numpy as np

from .. import checks
from ..errors import InvalidFile, InvalidValue, MissingPackage

SMALLEST, LARGEST = 1e-3, 2.0  # m; longest side of what a gripper handles


def read_stl(path: str | Path, scale: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the vertices (V, 3) [m] and the triangles (F, 3) of an STL file, binary or text.

    Args:
        path: The file.
        scale: Its unit [m].

    Raises:
        MissingPackage: trimesh is not installed.
        InvalidFile: The file cannot be read, or is no STL.
        InvalidValue: It has a number that is not finite, or a size that cannot be meant.
    """
    scale = checks.real("scale", scale, above=0, high=1e3, unit="m")
    try:
        import trimesh
    except ImportError:
        raise MissingPackage("an STL file", "trimesh", "mesh") from None
    try:
        content = Path(path).read_bytes()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InvalidFile(path, f"cannot be read: {reason}") from None
    load = partial(trimesh.load_mesh, file_type="stl")
    try:
        with np.errstate(all="ignore"):  # numbers are checked below
            try:
                mesh = load(io.BytesIO(content))
            except ImportError:  # of what trimesh guesses the encoding of a name or comment with
                mesh = load(io.BytesIO(content.decode("ascii", "replace").encode()))
    except Exception as error:  # trimesh raises whatever its parser stumbles over
        raise InvalidFile(path, f"is no STL file ({_line(error)})") from None
    vertices, faces = np.asarray(mesh.vertices, float), np.asarray(mesh.faces, int)
    if not len(faces):
        raise InvalidFile(path, "is no STL file, or has no triangles")
    if not np.isfinite(vertices).all():
        raise InvalidValue("vertices", "not a finite number", "finite", str(path))
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]  # specks, once points are one
    vertices = vertices * scale
    size = float(np.ptp(vertices, axis=0).max())
    if not SMALLEST <= size <= LARGEST:
        allowed = f"such that the body is {SMALLEST * 1e3:g} mm to {LARGEST:g} m long"
        hint = ""
        if SMALLEST <= size * 1e-3 <= LARGEST:
            hint = f"; it looks like millimetres: scale {scale * 1e-3:g}"
        elif SMALLEST <= size * 1e3 <= LARGEST:
            hint = f"; it looks like metres: scale {scale * 1e3:g}"
        raise InvalidValue("scale", scale, f"{allowed} (it is {size:.4g} m{hint})", str(path))
    return vertices, faces


def _line(error: Exception) -> str:
    text = " ".join(str(error).split())
    return f"{type(error).__name__}: {text}"[:120] if text else type(error).__name__
