# SPDX-License-Identifier: Apache-2.0
"""Fingers that the model's tests share."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from ccr_ros.model import Cable, Cylinder, Finger, Obstacle, Sphere

DATA = Path(__file__).parents[1] / "data" / "reference"
REFERENCES = sorted(path.stem for path in DATA.glob("*.json"))


def reference(name: str) -> dict[str, Any]:
    """The reference data of one case; see test/data/reference/README.md."""
    return json.loads((DATA / f"{name}.json").read_text())


def reference_finger(data: dict[str, Any]) -> Finger:
    """The finger of a reference case, forces per EI."""
    obstacles: tuple[Obstacle, ...] = ()
    if "obstacle" in data:
        o = data["obstacle"]
        if o["type"] == "sphere":
            obstacles = (Sphere(np.array(o["center"]), o["radius"], name="o"),)
        else:
            obstacles = (
                Cylinder(np.array(o["axis_point"]), np.array(o["axis"]), o["radius"], name="o"),
            )
    return Finger(
        name=data["name"],
        length=data["length"],
        segments=data["segments"],
        disk_radius=data["disk_radius"],
        backbone_diameter=0.0025,
        poisson_ratio=data["poisson"],
        cables=tuple(Cable(f"c{i}", np.array(a)) for i, a in enumerate(data["hole_angles"])),
        rest_curvature=np.array(data["rest_curvature"]),
        obstacles=obstacles,
    )


def make_finger(*cables: Cable, **changes: Any) -> Finger:
    """The paper's finger with these cables (default: a helical one)."""
    values: dict[str, Any] = {
        "name": "finger",
        "length": 0.182,
        "segments": 9,
        "disk_radius": 0.008,
        "backbone_diameter": 0.0025,
        "poisson_ratio": 0.39,
        "cables": cables or (helical_cable(),),
    }
    return Finger(**(values | changes))


def helical_cable() -> Cable:
    """Table I, Helical."""
    return Cable.from_holes("helical", [7, 8, 9, 10, 11, 12, 1, 2, 3, 4])


def straight_cable(hole: int = 4, disks: int = 10, name: str = "straight") -> Cable:
    """A cable through the same hole of every disk."""
    return Cable.from_holes(name, [hole] * disks)


def rms(a: np.ndarray, b: np.ndarray) -> float:
    """Root mean square distance of points (p, 3)."""
    return float(np.sqrt(np.mean(np.sum((np.asarray(a) - np.asarray(b)) ** 2, axis=1))))
