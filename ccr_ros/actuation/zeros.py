# SPDX-License-Identifier: Apache-2.0
"""The zeros that calibration found, in a file that survives power cuts."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

import yaml

from ccr_ros.model import checks
from ccr_ros.model.errors import InvalidFile, InvalidValue
from ccr_ros.model.file_checks import located, mapping
from ccr_ros.model.yaml_reader import read_mapping

from .rack import ServoRack

_LARGEST = 1e5  # rad; thousands of turns


def load_zeros(path: str | Path, rack: ServoRack, driver: str) -> dict[str, float]:
    """Return the stored zeros [rad] by joint; none where there is no file yet.

    Raises:
        InvalidFile: The file cannot be read, or is not YAML.
        InvalidValue: It is of another rack or driver, or a joint or a zero in it is not valid.
    """
    path = Path(path)
    if not path.exists():
        return {}
    try:
        data = mapping(read_mapping(path), {"servos", "driver", "zeros"}, set())
        for key, own in (("servos", rack.name), ("driver", driver)):
            if data[key] != own:
                allowed = f"{own!r}, as these zeros would be used for it; calibrate anew"
                raise InvalidValue(key, data[key], allowed)
        zeros = located("zeros", mapping, data["zeros"], set(), set(rack.names))
        return {
            name: checks.real(f"zeros.{name}", value, low=-_LARGEST, high=_LARGEST, unit="rad")
            for name, value in zeros.items()
        }
    except InvalidValue as error:
        raise error.located("", str(path)) from None


def save_zeros(path: str | Path, rack: ServoRack, driver: str, zeros: Mapping[str, float]) -> None:
    """Store zeros [rad] by joint: whatever happens, the file holds the old or the new ones.

    Raises:
        InvalidFile: It cannot be written.
    """
    path = Path(path)
    data = {"servos": rack.name, "driver": driver, "zeros": {k: float(v) for k, v in zeros.items()}}
    text = "# Servo angles [rad] at which the cables are just taut, found by calibration.\n"
    text += yaml.safe_dump(data, sort_keys=False)
    temporary = path.with_name(f".{path.name}.tmp")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with temporary.open("w", encoding="utf-8") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
        folder = os.open(path.parent, os.O_RDONLY)
        try:
            os.fsync(folder)  # the name, too, has to reach the disk
        finally:
            os.close(folder)
    except OSError as error:
        raise InvalidFile(path, f"cannot be written: {error.strerror}") from None
