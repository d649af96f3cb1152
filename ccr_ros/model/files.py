# SPDX-License-Identifier: Apache-2.0
"""Finger and gripper descriptions from YAML files, with every value checked and located."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from . import checks
from .errors import InvalidFile, InvalidValue
from .file_checks import located, mapping, sequence
from .finger import MAX_SEGMENTS, Cable, Finger
from .obstacle_files import obstacles_from_list
from .rotation import Pose
from .yaml_reader import read_mapping

_FINGER_KEYS = {
    "name", "length", "segments", "disk_radius", "backbone_diameter", "poisson_ratio",
    "youngs_modulus", "holes_per_disk", "rest_curvature", "cables", "obstacles",
}  # fmt: skip
_FINGER_NEEDS = {
    "name", "length", "segments", "disk_radius", "backbone_diameter", "poisson_ratio", "cables",
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class MountedFinger:
    """A finger and where its base stands in the gripper."""

    finger: Finger
    base: Pose


@dataclass(frozen=True, eq=False)
class Gripper:
    """A gripper: fingers by name, each with the pose of its base in the gripper's frame."""

    name: str
    fingers: tuple[MountedFinger, ...]

    @property
    def finger_names(self) -> tuple[str, ...]:
        """Names of the fingers."""
        return tuple(f.finger.name for f in self.fingers)


def load_finger(path: str | Path) -> Finger:
    """Read a finger file. A key without a value (null) counts as not given.

    Raises:
        InvalidFile: The file, or an STL file it names, cannot be read, or is not what it should be.
        InvalidValue: A key is unknown or missing, or a value is out of range; says file and place.
    """
    data = read_mapping(path)
    if "fingers" in data and "cables" not in data:
        raise InvalidFile(path, "describes a gripper (it has 'fingers'); a finger file is wanted")
    return finger_from_dict(data, source=str(path), folder=Path(path).parent)


def load_gripper(path: str | Path) -> Gripper:
    """Read a gripper file: ``name`` and ``fingers`` (``name``, ``base`` and a description each).

    A finger's description is given by ``file`` (a path relative to the gripper file) or in place
    under ``finger``; ``base`` holds ``position`` (3,) [m] and ``orientation`` (x, y, z, w).

    Raises:
        InvalidFile, InvalidValue: As for `load_finger`; what is wrong in a finger's own file is
            located in that file.
    """
    data = read_mapping(path)
    if "cables" in data and "fingers" not in data:
        raise InvalidFile(path, "describes a finger (it has 'cables'); a gripper file is wanted")
    try:
        data = mapping(data, {"name", "fingers"}, set())
        name = checks.name("name", data["name"])
        entries = sequence("fingers", data["fingers"])
        if not entries:
            raise InvalidValue("fingers", entries, "a list of at least one finger")
        fingers: list[MountedFinger] = []
        for i, entry in enumerate(entries):
            place = f"fingers[{i}]"
            fingers.append(located(place, _mounted, entry, Path(path), place))
            names = [f.finger.name for f in fingers]
            if names.count(names[-1]) > 1:
                raise InvalidValue(f"{place}.name", names[-1], "unique in its gripper")
    except InvalidValue as error:
        raise error if error.source else error.located("", str(path)) from None
    return Gripper(name, tuple(fingers))


def finger_from_dict(data: Any, source: str | None = None, folder: Path | None = None) -> Finger:
    """Make a finger from the mapping that a finger file holds; see `load_finger`.

    Args:
        data: The mapping.
        source: The file it came from, for messages.
        folder: What paths in it are relative to; default: the working directory.

    Raises:
        InvalidValue, InvalidFile: As for `load_finger`; ``source`` is the given one.
    """
    try:
        values = mapping(data, _FINGER_NEEDS, _FINGER_KEYS - _FINGER_NEEDS)
        holes_per_disk = checks.integer(
            "holes_per_disk", values.get("holes_per_disk", 12), low=1, high=3600
        )
        disks = checks.integer("segments", values["segments"], low=2, high=MAX_SEGMENTS) + 1
        values["cables"] = [
            located(f"cables[{i}]", _cable, c, holes_per_disk, disks)
            for i, c in enumerate(sequence("cables", values["cables"]))
        ]
        obstacles = values.get("obstacles", [])
        values["obstacles"] = obstacles_from_list(obstacles, "obstacles", folder)
        return Finger(**values)
    except InvalidValue as error:
        raise error if error.source else error.located("", source) from None


def _mounted(entry: Any, gripper_file: Path, place: str) -> MountedFinger:
    entry = mapping(entry, {"name", "base"}, {"file", "finger"})
    name = checks.name("name", entry["name"])
    if ("file" in entry) == ("finger" in entry):
        raise InvalidValue("", sorted(entry), "a mapping with exactly one of 'file' and 'finger'")
    base = located("base", _base, entry["base"])
    if "finger" in entry:
        inline = entry["finger"]
        if isinstance(inline, Mapping):  # else the error says so
            inline = {**inline, "name": name}
        made = located("finger", finger_from_dict, inline, None, gripper_file.parent)
        return MountedFinger(made, base)
    if not isinstance(entry["file"], str):
        raise InvalidValue("file", entry["file"], "a path relative to the gripper file")
    file = gripper_file.parent / entry["file"]
    try:
        description = read_mapping(file)
    except InvalidFile as error:
        named = f"{error.reason} (named by {gripper_file}: {place}.file)"
        raise InvalidFile(file, named) from None
    made = finger_from_dict({**description, "name": name}, str(file), file.parent)
    return MountedFinger(made, base)


def _base(entry: Any) -> Pose:
    return Pose(**mapping(entry, {"position"}, {"orientation"}))


def _cable(entry: Any, holes_per_disk: int, disks: int) -> Cable:
    entry = mapping(entry, {"name"}, {"holes", "angles", "last_disk"})
    if ("holes" in entry) == ("angles" in entry):
        raise InvalidValue("", sorted(entry), "a mapping with exactly one of 'holes' and 'angles'")
    key = "holes" if "holes" in entry else "angles"
    routing = entry[key]
    if isinstance(routing, list | tuple) and not 2 <= len(routing) <= disks:
        allowed = f"a list of 2..{disks} numbers, one per disk from the base (got {len(routing)})"
        raise InvalidValue(key, routing, allowed)
    if key == "holes":
        cable = Cable.from_holes(entry["name"], routing, holes_per_disk)
    else:
        cable = Cable(entry["name"], routing)
    if "last_disk" in entry:
        last = checks.integer("last_disk", entry["last_disk"], low=1, high=disks - 1)
        if last != cable.last_disk:
            allowed = f"{last + 1} numbers, for disks 0..{last} (last_disk); got {len(routing)}"
            raise InvalidValue(key, routing, allowed)
    return cable
