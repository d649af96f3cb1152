# SPDX-License-Identifier: Apache-2.0
"""Finger and gripper descriptions from YAML files, with every value checked and located."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from . import checks
from .errors import InvalidFile, InvalidValue
from .finger import Cable, Finger
from .obstacles import Box, Cylinder, Obstacle, Plane, Sphere
from .rotation import Pose

_FINGER_KEYS = {
    "name", "length", "segments", "disk_radius", "backbone_diameter", "poisson_ratio",
    "youngs_modulus", "holes_per_disk", "rest_curvature", "cables", "obstacles",
}  # fmt: skip
_FINGER_NEEDS = {
    "name", "length", "segments", "disk_radius", "backbone_diameter", "poisson_ratio", "cables",
}  # fmt: skip
_OBSTACLES: dict[str, tuple[type[Obstacle], set[str], set[str]]] = {
    "sphere": (Sphere, {"center", "radius"}, set()),
    "cylinder": (Cylinder, {"point", "axis", "radius"}, set()),
    "box": (Box, {"center", "size"}, {"orientation", "edge_radius"}),
    "plane": (Plane, {"point", "normal"}, set()),
}


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
    """Read a finger file.

    Raises:
        InvalidFile: The file cannot be read, is not YAML, or is not a mapping.
        InvalidValue: A key is unknown or missing, or a value is out of range; says file and place.
    """
    return finger_from_dict(_read(path), source=str(path))


def load_gripper(path: str | Path) -> Gripper:
    """Read a gripper file: ``name`` and ``fingers``, each with ``name``, ``base`` and a description.

    A finger's description is given by ``file`` (a path relative to the gripper file) or in place
    under ``finger``; ``base`` holds ``position`` (3,) [m] and ``orientation`` (x, y, z, w).

    Raises:
        InvalidFile, InvalidValue: As for `load_finger`.
    """
    source = str(path)
    data = _read(path)
    _keys("", data, {"name", "fingers"}, set(), source)
    try:
        name = checks.name("name", data["name"])
        entries = data["fingers"]
        if not isinstance(entries, list) or not entries:
            raise InvalidValue("fingers", entries, "a list of at least one finger")
        fingers: list[MountedFinger] = []
        for i, entry in enumerate(entries):
            fingers.append(_mounted_finger(f"fingers[{i}]", entry, Path(path)))
            names = [f.finger.name for f in fingers]
            if names.count(names[-1]) > 1:
                raise InvalidValue(f"fingers[{i}].name", names[-1], "unique in its gripper")
    except InvalidValue as error:
        raise error if error.source else error.located("", source) from None
    return Gripper(name, tuple(fingers))


def finger_from_dict(data: Any, source: str | None = None) -> Finger:
    """Make a finger from the mapping that a finger file holds; see `load_finger`."""
    _keys("", data, _FINGER_NEEDS, _FINGER_KEYS - _FINGER_NEEDS, source)
    try:
        values = {k: v for k, v in data.items() if k not in ("cables", "obstacles") and v is not None}
        holes_per_disk = checks.integer(
            "holes_per_disk", data.get("holes_per_disk", 12), low=1, high=3600
        )
        values["cables"] = tuple(
            _located(f"cables[{i}]", lambda c=c: _cable(c, holes_per_disk))  # type: ignore[misc]
            for i, c in enumerate(_list("cables", data["cables"]))
        )
        values["obstacles"] = obstacles_from_list(data.get("obstacles") or [], "obstacles")
        return Finger(**values)
    except InvalidValue as error:
        raise error.located("", source) from None


def obstacles_from_list(entries: Any, place: str = "obstacles") -> tuple[Obstacle, ...]:
    """Make obstacles from a list of mappings with a ``type`` key each (and an optional ``name``)."""
    obstacles: list[Obstacle] = []
    for i, entry in enumerate(_list(place, entries)):
        obstacle = _located(f"{place}[{i}]", lambda e=entry, i=i: _obstacle(e, i))  # type: ignore[misc]
        if obstacle.name in {o.name for o in obstacles}:
            raise InvalidValue(f"{place}[{i}].name", obstacle.name, "unique among the obstacles")
        obstacles.append(obstacle)
    return tuple(obstacles)


def _mounted_finger(place: str, entry: Any, path: Path) -> MountedFinger:
    _keys(place, entry, {"name", "base"}, {"file", "finger"}, None)
    name = checks.name(f"{place}.name", entry["name"])
    if ("file" in entry) == ("finger" in entry):
        raise InvalidValue(place, sorted(entry), "a mapping with exactly one of 'file' and 'finger'")
    if "file" in entry:
        if not isinstance(entry["file"], str):
            raise InvalidValue(f"{place}.file", entry["file"], "a path relative to the gripper file")
        file = path.parent / entry["file"]
        description, source = dict(_read(file)), str(file)
    else:
        if not isinstance(entry["finger"], Mapping):
            raise InvalidValue(f"{place}.finger", entry["finger"], "a mapping: a finger's description")
        description, source = dict(entry["finger"]), f"{path}: {place}.finger"
    description["name"] = name
    base = entry["base"]
    _keys(f"{place}.base", base, {"position"}, {"orientation"}, None)
    pose = _located(f"{place}.base", lambda: Pose(**base))
    return MountedFinger(finger_from_dict(description, source), pose)


def _cable(entry: Any, holes_per_disk: int) -> Cable:
    _keys("", entry, {"name"}, {"holes", "angles", "last_disk"}, None)
    if ("holes" in entry) == ("angles" in entry):
        raise InvalidValue("", sorted(entry), "a mapping with exactly one of 'holes' and 'angles'")
    if "holes" in entry:
        cable = Cable.from_holes(entry["name"], entry["holes"], holes_per_disk)
    else:
        cable = Cable(entry["name"], entry["angles"])
    if "last_disk" in entry:
        last = checks.integer("last_disk", entry["last_disk"], low=1)
        if last != cable.last_disk:
            key = "holes" if "holes" in entry else "angles"
            raise InvalidValue(key, entry[key], f"{last + 1} entries, for disks 0..last_disk = {last}")
    return cable


def _obstacle(entry: Any, index: int) -> Obstacle:
    _keys("", entry, {"type"}, None, None)
    kind = entry["type"]
    if not isinstance(kind, str) or kind not in _OBSTACLES:
        raise InvalidValue("type", kind, f"one of {', '.join(_OBSTACLES)}")
    cls, needs, may = _OBSTACLES[kind]
    _keys("", entry, needs | {"type"}, may | {"name"}, None)
    values = {k: v for k, v in entry.items() if k != "type"}
    values["name"] = checks.name("name", values.get("name", f"{kind}_{index}"))
    return cls(**values)


def _located(place: str, make: Callable[[], Any]) -> Any:
    try:
        return make()
    except InvalidValue as error:
        raise error.located(place) from None


def _list(place: str, value: Any) -> list[Any]:
    if not isinstance(value, list | tuple):
        raise InvalidValue(place, value, "a list")
    return list(value)


def _keys(place: str, data: Any, needs: set[str], may: set[str] | None, source: str | None) -> None:
    """Check that data is a mapping with the needed keys and, unless ``may`` is None, no unknown one."""
    if not isinstance(data, Mapping):
        raise InvalidValue(place, data, "a mapping", source)
    for key in data:
        if may is not None and key not in needs | may:
            where = f"{place}.{key}" if place else str(key)
            raise InvalidValue(
                where, data[key], f"absent: unknown key; valid keys: {', '.join(sorted(needs | may))}", source
            )
    for key in sorted(needs):
        if key not in data:
            where = f"{place}.{key}" if place else key
            raise InvalidValue(where, None, "given: this key is required", source)


class _Loader(yaml.SafeLoader):
    """YAML 1.1 reads 2.8e9 as text (its floats want a sign in the exponent); this reads a number."""

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
        """Refuse duplicate keys, of which YAML would silently keep the last."""
        seen = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            if isinstance(key, str) and key in seen:
                raise yaml.constructor.ConstructorError(
                    None, None, f"duplicate key {key!r}", key_node.start_mark
                )
            seen.add(key if isinstance(key, str) else str(key))
        return super().construct_mapping(node, deep=deep)


_Loader.yaml_implicit_resolvers = {k: list(v) for k, v in yaml.SafeLoader.yaml_implicit_resolvers.items()}
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    __import__("re").compile(r"^[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+$"),
    list("-+.0123456789"),
)


def _read(path: str | Path) -> Any:
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "not UTF-8 text"
        raise InvalidFile(path, f"cannot be read: {reason}") from None
    try:
        data = yaml.load(text, Loader=_Loader)  # noqa: S506 (a SafeLoader)
    except yaml.YAMLError as error:
        raise InvalidFile(path, f"not valid YAML: {' '.join(str(error).split())}") from None
    except RecursionError:
        raise InvalidFile(path, "not valid YAML: nested too deeply") from None
    if not isinstance(data, Mapping):
        raise InvalidFile(path, f"must hold a mapping of keys, not {type(data).__name__}")
    return data
