# SPDX-License-Identifier: Apache-2.0
"""Finger descriptions written as finger files; `files.load_finger` gives the same finger again."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from .errors import InvalidFile
from .finger import Cable, Finger
from .obstacle_files import obstacle_to_dict

_AT_HOLE = 1e-12  # rad; `Cable.from_holes` is right to this


def finger_to_dict(finger: Finger) -> dict[str, Any]:
    """Return a finger as the mapping that a finger file holds: plain numbers, lists and texts.

    A cable whose every angle is that of a hole is given by hole numbers, else by its angles.
    """
    data: dict[str, Any] = {
        "name": finger.name,
        "length": finger.length,
        "segments": finger.segments,
        "disk_radius": finger.disk_radius,
        "backbone_diameter": finger.backbone_diameter,
        "poisson_ratio": finger.poisson_ratio,
        "youngs_modulus": finger.youngs_modulus,
        "holes_per_disk": finger.holes_per_disk,
    }
    if finger.youngs_modulus is None:
        del data["youngs_modulus"]
    rest = np.asarray(finger.rest_curvature)
    if rest.any():
        data["rest_curvature"] = rest.tolist()
    data["cables"] = [_cable(cable, finger.holes_per_disk) for cable in finger.cables]
    if finger.obstacles:
        data["obstacles"] = [obstacle_to_dict(obstacle) for obstacle in finger.obstacles]
    return data


def finger_text(finger: Finger, comment: str = "") -> str:
    """Return a finger as the YAML text of a finger file, headed by a comment of some lines."""
    head = "".join(f"# {line}".rstrip() + "\n" for line in comment.splitlines())
    body = yaml.safe_dump(
        finger_to_dict(finger),
        sort_keys=False,
        default_flow_style=None,
        allow_unicode=True,
        width=math.inf,
    )
    return head + body


def write_finger(finger: Finger, path: str | Path, comment: str = "") -> Path:
    """Write a finger file and return its path.

    Raises:
        InvalidFile: It cannot be written.
    """
    out = Path(path)
    try:
        out.write_text(finger_text(finger, comment), encoding="utf-8")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InvalidFile(path, f"cannot be written: {reason}") from None
    return out


def _cable(cable: Cable, holes_per_disk: int) -> dict[str, Any]:
    turns = np.asarray(cable.angles) * holes_per_disk / (2 * math.pi)
    holes = np.round(turns)
    entry: dict[str, Any] = {"name": cable.name}
    if np.abs(turns - holes).max() * (2 * math.pi) / holes_per_disk <= _AT_HOLE:
        entry["holes"] = [int(h) % holes_per_disk + 1 for h in holes]
    else:
        entry["angles"] = cable.angles.tolist()
    return entry
