# SPDX-License-Identifier: Apache-2.0
"""A rack of servos that wind the cables of a gripper, and the file that describes it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import Any

from ccr_ros.model import checks
from ccr_ros.model.errors import InvalidValue, UnknownName
from ccr_ros.model.file_checks import located, mapping, sequence
from ccr_ros.model.files import Gripper
from ccr_ros.model.yaml_reader import read_mapping


@dataclass(frozen=True, kw_only=True)
class ServoJoint:
    """One servo, its spool and the cable on it.

    Attributes:
        finger, cable: What it pulls; the joint is called ``<finger>_<cable>``.
        spool_radius: Of the cable's centre line on the spool [m].
        direction: 1 where growing angles wind the cable up, -1 where they pay it out.
        gear: Turns of the servo per turn of the spool.
        offset: Pull at which calibration finds the cable just taut [m]; 0 at the rest shape.
        travel: Least and largest pull [m].
        max_rate, max_acceleration: Of the pull [m/s], [m/s^2].
        cable_stiffness: Force per stretch of the whole cable [N/m]; infinite: does not stretch.
        max_tension: More is a fault [N].
        max_temperature: More is a fault [degC].
        tolerance: Distance between setpoint and measured pull that is not worth a word [m].
        efficiency: Of gear and spool, 0 to 1: how much of the torque reaches the cable.
        id: The servo's number on its bus, where there is one.
        current_limit: Largest current of the servo [A], where the driver can set it.
        torque_constant: Torque at the servo's shaft per current [N m/A], for drivers that read
            currents; None: they know no effort.

    Raises:
        InvalidValue: A value is out of its range.
    """

    finger: str
    cable: str
    spool_radius: float
    travel: tuple[float, float]
    max_rate: float
    max_acceleration: float
    max_tension: float
    direction: int = 1
    gear: float = 1.0
    offset: float = 0.0
    cable_stiffness: float = math.inf
    max_temperature: float = 70.0
    tolerance: float = 0.001
    efficiency: float = 1.0
    id: int | None = None
    current_limit: float | None = None
    torque_constant: float | None = None

    def __post_init__(self) -> None:
        def keep(key: str, value: Any) -> None:
            object.__setattr__(self, key, value)

        def real(key: str, **limits: Any) -> None:
            keep(key, checks.real(key, getattr(self, key), **limits))

        checks.name("finger", self.finger)
        checks.name("cable", self.cable)
        real("spool_radius", low=1e-4, high=1.0, unit="m")
        low, high = map(float, checks.vector("travel", self.travel, 2, unit="m", largest=10.0))
        if not low <= 0.0 < high:
            raise InvalidValue("travel", self.travel, "[least, largest] pull, least <= 0 < largest")
        keep("travel", (low, high))
        real("max_rate", low=1e-5, high=10.0, unit="m/s")
        real("max_acceleration", low=1e-5, high=1e3, unit="m/s^2")
        real("max_tension", low=0.01, high=1e5, unit="N")
        if checks.integer("direction", self.direction, low=-1, high=1) == 0:
            raise InvalidValue("direction", self.direction, "1 (winds up) or -1")
        real("gear", low=1e-3, high=1e3)
        real("offset", low=low, high=high, unit="m")
        if self.cable_stiffness != math.inf:
            real("cable_stiffness", low=1.0, unit="N/m")
        real("max_temperature", low=0.0, high=200.0, unit="degC")
        real("tolerance", low=1e-6, high=0.1, unit="m")
        real("efficiency", low=0.01, high=1.0)
        if self.id is not None:
            keep("id", checks.integer("id", self.id, low=0, high=252))
        if self.current_limit is not None:
            real("current_limit", low=0.001, high=100.0, unit="A")
        if self.torque_constant is not None:
            real("torque_constant", low=1e-6, high=1e3, unit="N m/A")

    @property
    def name(self) -> str:
        """Name of the joint, as in joint_states."""
        return f"{self.finger}_{self.cable}"


_KEYS = {field.name for field in fields(ServoJoint)}
_NEEDED = {field.name for field in fields(ServoJoint) if field.default is MISSING}
_OWN = {"finger", "cable", "id"}  # of one joint alone: not for `defaults`


@dataclass(frozen=True)
class ServoRack:
    """Servos by name, in the order of their commands."""

    name: str
    joints: tuple[ServoJoint, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the joints."""
        return tuple(joint.name for joint in self.joints)

    def index(self, name: str) -> int:
        """Return the place of a joint in the order of the commands.

        Raises:
            UnknownName: There is no such joint.
        """
        if name not in self.names:
            raise UnknownName("joint", name, self.names)
        return self.names.index(name)

    def of_finger(self, finger: str, cables: tuple[str, ...]) -> tuple[int, ...]:
        """Return the places of a finger's joints, in the order of its cables."""
        return tuple(self.index(f"{finger}_{cable}") for cable in cables)


def load_servos(path: str | Path, gripper: Gripper) -> ServoRack:
    """Read a servo file: ``name``, ``joints``, and ``defaults`` for keys that joints share.

    Raises:
        InvalidFile: The file cannot be read, is not YAML, or is not a mapping.
        InvalidValue: A key is unknown or missing, a value is out of range, a joint is of no cable
            of the gripper, or a cable of the gripper has no joint; says file and place.
    """
    try:
        data = mapping(read_mapping(path), {"name", "joints"}, {"defaults"})
        name = checks.name("name", data["name"])
        defaults = located("defaults", mapping, data.get("defaults", {}), set(), _KEYS - _OWN)
        joints: list[ServoJoint] = []
        for i, entry in enumerate(sequence("joints", data["joints"])):
            joint = located(f"joints[{i}]", _joint, entry, defaults, gripper)
            for key in ("name", "id"):
                value = getattr(joint, key)
                if value is not None and value in (getattr(other, key) for other in joints):
                    raise InvalidValue(f"joints[{i}].{key}", value, "unique in its rack")
            joints.append(joint)
        served = {(joint.finger, joint.cable) for joint in joints}
        for finger in (mounted.finger for mounted in gripper.fingers):
            for cable in finger.cable_names:
                if (finger.name, cable) not in served:
                    allowed = f"complete: the cable {cable!r} of {finger.name!r} has no servo"
                    raise InvalidValue("joints", [joint.name for joint in joints], allowed)
    except InvalidValue as error:
        raise error if error.source else error.located("", str(path)) from None
    return ServoRack(name, tuple(joints))


def _joint(entry: Any, defaults: Mapping[str, Any], gripper: Gripper) -> ServoJoint:
    own = mapping(entry, {"finger", "cable"}, _KEYS - {"finger", "cable"})
    fingers = {mounted.finger.name: mounted.finger for mounted in gripper.fingers}
    if own["finger"] not in fingers:
        allowed = f"a finger of the gripper {gripper.name!r}: {', '.join(fingers)}"
        raise InvalidValue("finger", own["finger"], allowed)
    cables = fingers[own["finger"]].cable_names
    if own["cable"] not in cables:
        raise InvalidValue("cable", own["cable"], f"a cable of the finger: {', '.join(cables)}")
    return ServoJoint(**mapping({**defaults, **own}, _NEEDED, _KEYS))
