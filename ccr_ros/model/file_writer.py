# SPDX-License-Identifier: Apache-2.0
"""Finger descriptions as mappings and as YAML files, such as `files` reads."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from .errors import InvalidFile, InvalidValue
from .finger import Cable, Finger
from .obstacles import Box, Cylinder, Obstacle, Plane, Sphere

_ON_HOLE = 1e-12  # rad; an angle this near a clock hole's is written as the hole

_OBSTACLE_KEYS: dict[type[Obstacle], tuple[str, tuple[str, ...]]] = {
    Sphere: ("sphere", ("center", "radius")),
    Cylinder: ("cylinder", ("point", "axis", "radius")),
    Box: ("box", ("center", "size", "orientation", "edge_radius")),
    Plane: ("plane", ("point", "normal")),
}


def finger_to_dict(finger: Finger) -> dict[str, Any]:
    """Return the mapping that a finger file holds; `finger_from_dict` makes the finger of it.

    Raises:
        InvalidValue: An obstacle of a kind that files do not know.
    """
    data: dict[str, Any] = {
        "name": finger.name,
        "length": finger.length,
        "segments": finger.segments,
        "disk_radius": finger.disk_radius,
        "backbone_diameter": finger.backbone_diameter,
        "poisson_ratio": finger.poisson_ratio,
    }
    if finger.youngs_modulus is not None:
        data["youngs_modulus"] = finger.youngs_modulus
    data["holes_per_disk"] = finger.holes_per_disk
    rest = np.asarray(finger.rest_curvature)
    if rest.any():
        data["rest_curvature"] = (rest + 0.0).tolist()  # + 0.0: no "-0.0"
    data["cables"] = [_cable(cable, finger) for cable in finger.cables]
    if finger.obstacles:
        data["obstacles"] = [
            _obstacle(obstacle, f"obstacles[{i}]") for i, obstacle in enumerate(finger.obstacles)
        ]
    return data


def write_finger(path: str | Path, finger: Finger, comment: str = "") -> None:
    """Write a finger file; the lines of ``comment`` stand at its head.

    Raises:
        InvalidFile: The file cannot be written.
        InvalidValue: As for `finger_to_dict`.
    """
    lines = ["# " + line if line else "#" for line in comment.splitlines()]
    text = yaml.safe_dump(
        finger_to_dict(finger),
        sort_keys=False,
        default_flow_style=None,
        width=100,
        allow_unicode=True,
    )
    try:
        Path(path).write_text("\n".join([*lines, text]), encoding="utf-8")
    except (OSError, ValueError) as error:  # ValueError: a null byte in the path
        reason = getattr(error, "strerror", None) or error
        raise InvalidFile(path, f"cannot be written: {reason}") from None


def _cable(cable: Cable, finger: Finger) -> dict[str, Any]:
    step = 2 * math.pi / finger.holes_per_disk
    holes = np.rint(cable.angles / step).astype(int)
    entry: dict[str, Any] = {"name": cable.name}
    if np.abs(holes * step - cable.angles).max() <= _ON_HOLE and holes.min() >= 0:
        on_clock = holes.max() < finger.holes_per_disk
    else:
        on_clock = False
    if on_clock:
        entry["holes"] = (holes + 1).tolist()
    else:
        entry["angles"] = cable.angles.tolist()
    if cable.last_disk < finger.segments:
        entry["last_disk"] = cable.last_disk
    return entry


def _obstacle(obstacle: Obstacle, place: str) -> dict[str, Any]:
    known = _OBSTACLE_KEYS.get(type(obstacle))
    if known is None:
        names = ", ".join(name for name, _ in _OBSTACLE_KEYS.values())
        raise InvalidValue(place, obstacle, f"an obstacle that files know: {names}")
    kind, keys = known
    values = {key: getattr(obstacle, key) for key in keys}
    plain = {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in values.items()}
    return {"type": kind, "name": obstacle.name, **plain}
