# SPDX-License-Identifier: Apache-2.0
"""Recordings as JSON: SI units, lengths rounded to a micrometre, quaternions as (x, y, z, w)."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..model.errors import InvalidFile, InvalidValue
from ..model.rotation import Pose
from ..model.solution import Contact
from .recorded_grasp import GripContact, GripFrame
from .recording import FingerFrame, Frame, RecordedFinger, Recording, SolidObject

FORMAT = "ccr_ros recording"
VERSION = 1


def recording_to_json(recording: Recording) -> str:
    """Return the recording as compact JSON text; see `recording_from_json` for the way back."""
    data = {
        "format": FORMAT,
        "version": VERSION,
        "gripper": recording.gripper,
        "forces_are": recording.forces_are,
        "fingers": [
            {
                "name": f.name,
                "base": _pose(f.base),
                "disk_radius": f.disk_radius,
                "backbone_diameter": f.backbone_diameter,
                "cables": list(f.cables),
                "rest_lengths": list(f.rest_lengths),
            }
            for f in recording.fingers
        ],
        "objects": [_object(o) for o in recording.objects],
        "frames": [_frame(frame) for frame in recording.frames],
    }
    return json.dumps(data, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def recording_from_json(text: str, source: str = "recording") -> Recording:
    """Read what `recording_to_json` wrote.

    Args:
        text: The JSON text.
        source: The file it came from, for messages.

    Raises:
        InvalidFile: Not JSON, or not a recording of a known version.
        InvalidValue, UnknownName: A value is missing or wrong; says which.
    """
    try:
        data = json.loads(text)
    except ValueError as error:
        raise InvalidFile(source, f"not valid JSON: {error}") from None
    except RecursionError:
        raise InvalidFile(source, "not valid JSON: nested too deeply") from None
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        raise InvalidFile(source, f"not a recording: its 'format' must be {FORMAT!r}")
    if data.get("version") != VERSION:
        raise InvalidFile(
            source, f"version {data.get('version')!r} is not known; this reads {VERSION}"
        )
    try:
        return Recording(
            gripper=_get(data, "gripper", str),
            forces_are=_get(data, "forces_are", str),
            fingers=tuple(_each("fingers", _get(data, "fingers", list), _read_finger)),
            objects=tuple(_each("objects", _get(data, "objects", list), _read_object)),
            frames=tuple(_each("frames", _get(data, "frames", list), _read_frame)),
        )
    except InvalidValue as error:
        raise error if error.source else error.located("", source) from None


def save_recording(recording: Recording, path: str | Path) -> Path:
    """Write a recording to a JSON file and return its path.

    Raises:
        InvalidFile: The file cannot be written.
    """
    return write_text(path, recording_to_json(recording))


def load_recording(path: str | Path) -> Recording:
    """Read a recording from a JSON file.

    Raises:
        InvalidFile, InvalidValue, UnknownName: As for `recording_from_json`.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except OSError as error:
        raise InvalidFile(path, f"cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise InvalidFile(path, "cannot be read: not UTF-8 text") from None
    return recording_from_json(text, str(path))


def write_text(path: str | Path, text: str) -> Path:
    """Write UTF-8 text to a file, with an `InvalidFile` that says why where that fails."""
    try:
        Path(path).write_text(text, encoding="utf-8")
    except OSError as error:
        raise InvalidFile(path, f"cannot be written: {error.strerror}") from None
    return Path(path)


def _round(values: Any, digits: int = 6) -> Any:
    # Adding zero turns -0.0 into 0.0: shorter, and equal after a round trip.
    return (np.round(np.asarray(values, dtype=float), digits) + 0.0).tolist()


def _significant(value: float) -> float:
    return float(f"{value:.6g}") + 0.0


def _pose(pose: Pose) -> dict[str, Any]:
    return {"position": _round(pose.position), "orientation": _round(pose.orientation)}


def _object(body: SolidObject) -> dict[str, Any]:
    data = {"name": body.name, "kind": body.kind, "dimensions": list(body.dimensions)}
    if body.vertices is not None and body.faces is not None:
        data |= {"vertices": _round(body.vertices), "faces": body.faces.tolist()}
    return {**data, **_pose(body.pose)}


def _frame(frame: Frame) -> dict[str, Any]:
    out: dict[str, Any] = {
        "time": round(frame.time, 6),
        "fingers": {name: _finger_frame(f) for name, f in frame.fingers.items()},
    }
    if frame.objects is not None:
        out["objects"] = {name: _pose(pose) for name, pose in frame.objects.items()}
    if frame.phase:
        out["phase"] = frame.phase
    if frame.grip is not None:
        out["grip"] = {
            "object": frame.grip.object,
            "held": frame.grip.held,
            "contacts": [
                {
                    "finger": c.finger,
                    "position": _round(c.position),
                    "force": _significant(c.force),
                    "friction": [_significant(f) for f in c.friction.tolist()],
                    "margin": None if c.margin is None else _significant(c.margin),
                }
                for c in frame.grip.contacts
            ],
        }
    return out


def _finger_frame(finger: FingerFrame) -> dict[str, Any]:
    out = {
        "pulls": _round(finger.pulls),
        "tensions": [_significant(t) for t in finger.tensions.tolist()],
        "backbone": _round(finger.backbone),
        "orientations": _round(finger.orientations, 5),
        "cables": {name: _round(points) for name, points in finger.cables.items()},
        "contacts": [
            {
                "disk": c.disk,
                "point": c.point,
                "cable": c.cable,
                "obstacle": c.obstacle,
                "position": _round(c.position),
                "normal": _round(c.normal, 5),
                "force": _significant(c.force),
            }
            for c in finger.contacts
        ],
        "converged": finger.converged,
        "stable": finger.stable,
        "stale": finger.stale,
    }
    if finger.servo_angles is not None:
        out["servo_angles"] = _round(finger.servo_angles, 5)
    return out


def _get(data: Any, key: str, kind: type) -> Any:
    if not isinstance(data, Mapping):
        raise InvalidValue("", data, "a JSON object")
    if key not in data:
        raise InvalidValue(key, None, "given: this key is required")
    if not isinstance(data[key], kind):
        names = {
            dict: "a JSON object",
            list: "a list",
            str: "a text",
            bool: "true or false",
            int: "an integer",
        }
        raise InvalidValue(key, data[key], names[kind])
    return data[key]


def _each(place: str, entries: list[Any], read: Callable[[Any], Any]) -> list[Any]:
    out = []
    for i, entry in enumerate(entries):
        try:
            out.append(read(entry))
        except InvalidValue as error:
            raise error.located(f"{place}[{i}]") from None
    return out


def _read_pose(data: Any) -> Pose:
    return Pose(_get(data, "position", list), _get(data, "orientation", list))


def _read_finger(data: Any) -> RecordedFinger:
    return RecordedFinger(
        name=_get(data, "name", str),
        base=_read_pose(_get(data, "base", dict)),
        disk_radius=data.get("disk_radius"),
        cables=tuple(_get(data, "cables", list)),
        backbone_diameter=data.get("backbone_diameter"),
        rest_lengths=tuple(_get(data, "rest_lengths", list)),
    )


def _read_object(data: Any) -> SolidObject:
    return SolidObject(
        name=_get(data, "name", str),
        kind=_get(data, "kind", str),
        dimensions=tuple(_get(data, "dimensions", list)),
        pose=_read_pose(data),
        vertices=data.get("vertices"),
        faces=data.get("faces"),
    )


def _read_frame(data: Any) -> Frame:
    fingers = {}
    for name, entry in _get(data, "fingers", dict).items():
        try:
            fingers[name] = _read_finger_frame(entry)
        except InvalidValue as error:
            raise error.located(f"fingers.{name}") from None
    objects = None
    if "objects" in data:
        objects = {name: _read_pose(pose) for name, pose in _get(data, "objects", dict).items()}
    grip = None
    if "grip" in data:
        try:
            grip = _read_grip(_get(data, "grip", dict))
        except InvalidValue as error:
            raise error.located("grip") from None
    return Frame(data.get("time"), fingers, objects, data.get("phase", ""), grip)


def _read_grip(data: Any) -> GripFrame:
    contacts = _each("contacts", _get(data, "contacts", list), _read_grip_contact)
    return GripFrame(_get(data, "object", str), _get(data, "held", bool), tuple(contacts))


def _read_grip_contact(data: Any) -> GripContact:
    return GripContact(
        finger=_get(data, "finger", str),
        position=_get(data, "position", list),
        force=data.get("force"),
        friction=_get(data, "friction", list),
        margin=data.get("margin"),
    )


def _read_finger_frame(data: Any) -> FingerFrame:
    return FingerFrame(
        pulls=_get(data, "pulls", list),
        tensions=_get(data, "tensions", list),
        backbone=_get(data, "backbone", list),
        orientations=_get(data, "orientations", list),
        cables=_get(data, "cables", dict),
        contacts=tuple(_each("contacts", _get(data, "contacts", list), _read_contact)),
        converged=_get(data, "converged", bool),
        stable=_get(data, "stable", bool),
        stale=_get(data, "stale", bool),
        servo_angles=data.get("servo_angles"),
    )


def _read_contact(data: Any) -> Contact:
    _get(data, "disk", int)
    return Contact(
        disk=data.get("disk"),
        point=_get(data, "point", str),
        cable=_get(data, "cable", str),
        obstacle=_get(data, "obstacle", str),
        position=_get(data, "position", list),
        normal=_get(data, "normal", list),
        force=data.get("force"),
    )
