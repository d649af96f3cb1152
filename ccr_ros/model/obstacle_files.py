# SPDX-License-Identifier: Apache-2.0
"""Obstacles as finger files hold them: lists of mappings with a type, read and written."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from . import checks
from .errors import InvalidFile, InvalidValue
from .file_checks import located, mapping, sequence
from .obstacles import (
    Box,
    Capsule,
    ConvexMesh,
    Cylinder,
    FiniteCylinder,
    Obstacle,
    Plane,
    Sphere,
)
from .rotation import Pose

_KINDS: dict[str, tuple[type[Obstacle], set[str], set[str]]] = {
    "sphere": (Sphere, {"center", "radius"}, set()),
    "capsule": (Capsule, {"start", "end", "radius"}, set()),
    "cylinder": (Cylinder, {"point", "axis", "radius"}, set()),
    "finite_cylinder": (FiniteCylinder, {"center", "axis", "height", "radius"}, {"edge_radius"}),
    "box": (Box, {"center", "size"}, {"orientation", "edge_radius"}),
    "mesh": (ConvexMesh, set(), {"position", "orientation", "edge_radius"}),
    "plane": (Plane, {"point", "normal"}, set()),
}
_STL_KEYS = {"scale", "hull", "centred"}
_NAMES = {cls: kind for kind, (cls, _, _) in _KINDS.items()}


def obstacles_from_list(
    entries: Any, place: str = "obstacles", folder: Path | None = None
) -> tuple[Obstacle, ...]:
    """Make obstacles from a list of mappings with a ``type`` key (and an optional ``name``).

    Args:
        entries: The list.
        place: Where it stands, for messages.
        folder: What the path of a mesh's file is relative to; default: the working directory.

    Raises:
        InvalidValue: An entry or a mesh is wrong; says where.
        InvalidFile: A mesh's file cannot be read.
        MissingPackage: A mesh is given, and what reads it is not installed.
    """
    obstacles: list[Obstacle] = []
    for i, entry in enumerate(sequence(place, entries)):
        try:
            obstacle = located(f"{place}[{i}]", _obstacle, entry, i, folder or Path())
        except InvalidFile as error:
            named = f"{error.reason} (named by {place}[{i}].file)"
            raise InvalidFile(error.path, named) from None
        if obstacle.name in {o.name for o in obstacles}:
            raise InvalidValue(f"{place}[{i}].name", obstacle.name, "unique among the obstacles")
        obstacles.append(obstacle)
    return tuple(obstacles)


def obstacle_to_dict(obstacle: Obstacle) -> dict[str, Any]:
    """Return an obstacle as the mapping that a finger file holds; a mesh by its vertices."""
    entry: dict[str, Any] = {"type": _NAMES[type(obstacle)], "name": obstacle.name}
    for field in fields(obstacle):
        if field.init:
            value = getattr(obstacle, field.name)
            entry[field.name] = value.tolist() if isinstance(value, np.ndarray) else value
    return entry


def _obstacle(entry: Any, index: int, folder: Path) -> Obstacle:
    kind = mapping(entry, {"type"}, None)["type"]
    if not isinstance(kind, str) or kind not in _KINDS:
        raise InvalidValue("type", kind, f"one of {', '.join(_KINDS)}")
    cls, needs, may = _KINDS[kind]
    if cls is ConvexMesh:
        by_file = "file" in entry
        if by_file == ("vertices" in entry):
            allowed = "a mapping with either 'file' or 'vertices' and 'faces'"
            raise InvalidValue("", sorted(map(str, entry)), allowed)
        needs, may = ({"file"}, may | _STL_KEYS) if by_file else ({"vertices", "faces"}, may)
    values = mapping(entry, needs | {"type"}, may | {"name"})
    del values["type"]
    values["name"] = checks.label("name", values.get("name", f"{kind}_{index}"))
    return _mesh(values, folder) if "file" in values else cls(**values)


def _mesh(values: dict[str, Any], folder: Path) -> ConvexMesh:
    file = values.pop("file")
    if not isinstance(file, str):
        raise InvalidValue("file", file, "the path of an STL file, relative to this file")
    for key in ("hull", "centred"):
        if not isinstance(values.get(key, False), bool):
            raise InvalidValue(key, values[key], "true or false")
    pose = Pose(**{key: values.pop(key) for key in ("position", "orientation") if key in values})
    return ConvexMesh.from_stl(folder / file, **values).moved(pose)
