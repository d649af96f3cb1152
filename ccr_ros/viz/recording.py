# SPDX-License-Identifier: Apache-2.0
"""A recorded run of a gripper: what stood where, and how the fingers moved over time.

Frames: whatever belongs to a finger (backbone, orientations, cables, contacts) is in that finger's
base frame, as a `Solution` is; the bases and the objects are in the gripper's frame.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np

from ..model import checks
from ..model.errors import InvalidValue, UnknownName
from ..model.rotation import Pose
from ..model.solution import Contact
from .recorded_grasp import GripFrame, heading
from .solids import SolidObject, array, label

FORCES_ARE = ("newton", "per_EI")
CONTACT_POINTS = ("backbone", "cable", "antagonist")


@dataclass(frozen=True, eq=False)
class RecordedFinger:
    """What stays the same of one finger during a recording.

    Attributes:
        name: Unique in its recording.
        base: Pose of the finger's base in the gripper's frame.
        disk_radius: [m].
        cables: Names of the cables, in the order of pulls and tensions.
        backbone_diameter: [m].
        rest_lengths: (m,) cable lengths at rest [m], which percentages refer to; may be empty.
    """

    name: str
    base: Pose
    disk_radius: float
    cables: tuple[str, ...]
    backbone_diameter: float = 0.0025
    rest_lengths: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        label("name", self.name)
        checks.real("disk_radius", self.disk_radius, above=0, unit="m")
        checks.real("backbone_diameter", self.backbone_diameter, above=0, unit="m")
        cables = tuple(label(f"cables[{i}]", c) for i, c in enumerate(self.cables))
        if not cables or len(set(cables)) != len(cables):
            raise InvalidValue(
                "cables", cables, "a list of at least one cable name, without duplicates"
            )
        if len(self.rest_lengths) not in (0, len(cables)):
            raise InvalidValue(
                "rest_lengths", self.rest_lengths, f"empty or {len(cables)} lengths [m]"
            )
        lengths = tuple(
            checks.real(f"rest_lengths[{i}]", v, above=0, unit="m")
            for i, v in enumerate(self.rest_lengths)
        )
        object.__setattr__(self, "cables", cables)
        object.__setattr__(self, "rest_lengths", lengths)


@dataclass(frozen=True, eq=False)
class FingerFrame:
    """One finger at one moment, in its base frame.

    Attributes:
        pulls: (m,) [m].
        tensions: (m,) >= 0 [N, or 1/m^2 per EI].
        backbone: (n+1, 3) disk centres, base to tip [m].
        orientations: (n+1, 4) disk orientations (x, y, z, w), z along the backbone.
        cables: Cable points {name: (k+1, 3)} [m]; a cable that was not received may be absent.
        contacts: The active contacts.
        converged, stable: What the solver's certificate says.
        stale: The pose is older than the pulls: it is the last good one.
        servo_angles: (m,) angle of each cable's servo [rad]; ``None``: not known.
    """

    pulls: np.ndarray
    tensions: np.ndarray
    backbone: np.ndarray
    orientations: np.ndarray
    cables: Mapping[str, np.ndarray] = field(default_factory=dict)
    contacts: tuple[Contact, ...] = ()
    converged: bool = True
    stable: bool = True
    stale: bool = False
    servo_angles: np.ndarray | None = None

    def __post_init__(self) -> None:
        pulls = array("pulls", self.pulls, (None,), "m")
        tensions = array("tensions", self.tensions, (len(pulls),))
        if np.any(tensions < 0):
            worst = int(np.argmin(tensions))
            raise InvalidValue(f"tensions[{worst}]", float(tensions[worst]), "a finite number >= 0")
        backbone = array("backbone", self.backbone, (None, 3), "m")
        if len(backbone) < 2:
            raise InvalidValue("backbone", len(backbone), "at least 2 disk centres, base to tip")
        turns = array("orientations", self.orientations, (len(backbone), 4))
        norms = np.linalg.norm(turns, axis=1, keepdims=True)
        if np.any(np.abs(norms - 1.0) > 0.01):
            worst = int(np.argmax(np.abs(norms - 1.0)))
            raise InvalidValue(f"orientations[{worst}]", turns[worst].tolist(), "a unit quaternion")
        turns = turns / norms
        turns.setflags(write=False)
        cables = {n: array(f"cables.{n}", p, (None, 3), "m") for n, p in dict(self.cables).items()}
        contacts = tuple(
            _contact(f"contacts[{i}]", c, len(backbone) - 1) for i, c in enumerate(self.contacts)
        )
        values = {"pulls": pulls, "tensions": tensions, "backbone": backbone, "orientations": turns}
        values |= {"cables": MappingProxyType(cables), "contacts": contacts}
        if self.servo_angles is not None:
            values["servo_angles"] = array("servo_angles", self.servo_angles, (len(pulls),), "rad")
        for key, value in values.items():
            object.__setattr__(self, key, value)


@dataclass(frozen=True, eq=False)
class Frame:
    """The gripper at one moment.

    Attributes:
        time: Since the start of the recording [s].
        fingers: By name; a finger that had not been heard of yet is absent.
        objects: Pose of each object present, by name; ``None``: all, at their recorded poses.
        phase: What the gripper is doing, in a word or two; empty: not known.
        grip: Of the object that is solved together with the fingers; ``None``: there is none.
    """

    time: float
    fingers: Mapping[str, FingerFrame]
    objects: Mapping[str, Pose] | None = None
    phase: str = ""
    grip: GripFrame | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "time", checks.real("time", self.time, low=0, unit="s"))
        object.__setattr__(self, "fingers", MappingProxyType(dict(self.fingers)))
        if not isinstance(self.phase, str):
            raise InvalidValue("phase", self.phase, "a text")
        if self.objects is not None:
            object.__setattr__(self, "objects", MappingProxyType(dict(self.objects)))


@dataclass(frozen=True, eq=False)
class Recording:
    """A run of a gripper.

    Attributes:
        gripper: Name of the gripper.
        fingers: What stays the same, per finger.
        frames: At least one, times strictly increasing.
        objects: Every object that appears.
        forces_are: ``"newton"`` or ``"per_EI"`` [1/m^2]: unit of tensions and contact forces.

    Raises:
        InvalidValue: A value is out of range or does not fit the others; says which and where.
        UnknownName: A frame names a finger, cable or object that the recording does not have.
    """

    gripper: str
    fingers: tuple[RecordedFinger, ...]
    frames: tuple[Frame, ...]
    objects: tuple[SolidObject, ...] = ()
    forces_are: str = "newton"

    def __post_init__(self) -> None:
        label("gripper", self.gripper)
        if self.forces_are not in FORCES_ARE:
            raise InvalidValue("forces_are", self.forces_are, f"one of {', '.join(FORCES_ARE)}")
        for kind in ("fingers", "frames", "objects"):
            object.__setattr__(self, kind, tuple(getattr(self, kind)))
        if not self.fingers:
            raise InvalidValue("fingers", (), "at least one finger")
        if not self.frames:
            raise InvalidValue("frames", (), "at least one frame (was nothing received?)")
        _unique("fingers", [f.name for f in self.fingers])
        _unique("objects", [o.name for o in self.objects])
        last = -1.0
        for i, frame in enumerate(self.frames):
            if frame.time <= last:
                raise InvalidValue(
                    f"frames[{i}].time", frame.time, f"later than the frame before ({last} s)"
                )
            last = frame.time
            self._check_frame(f"frames[{i}]", frame)

    def _check_frame(self, place: str, frame: Frame) -> None:
        known = {f.name: f for f in self.fingers}
        for name, moment in frame.fingers.items():
            if name not in known:
                raise UnknownName("finger", name, known)
            finger, where = known[name], f"{place}.fingers.{name}"
            if len(moment.pulls) != len(finger.cables):
                raise InvalidValue(
                    f"{where}.pulls", moment.pulls.tolist(), f"{len(finger.cables)} numbers"
                )
            for cable, points in moment.cables.items():
                if cable not in finger.cables:
                    raise UnknownName("cable", cable, finger.cables)
                if not 2 <= len(points) <= len(moment.backbone):
                    raise InvalidValue(
                        f"{where}.cables.{cable}",
                        len(points),
                        f"2..{len(moment.backbone)} points, one per disk from the base on",
                    )
        objects = [o.name for o in self.objects]
        for name in (*(frame.objects or ()), *([frame.grip.object] if frame.grip else ())):
            if name not in objects:
                raise UnknownName("object", name, objects)
        for contact in frame.grip.contacts if frame.grip else ():
            if contact.finger not in known:
                raise UnknownName("finger", contact.finger, known)

    @property
    def duration(self) -> float:
        """Time of the last frame [s]."""
        return self.frames[-1].time

    @property
    def phases(self) -> tuple[tuple[float, str], ...]:
        """Phases in turn, each with the time [s] it begins at; empty where none is known."""
        found: list[tuple[float, str]] = []
        for frame in self.frames:
            if frame.phase != (found[-1][1] if found else ""):
                found.append((frame.time, frame.phase))
        return tuple(found)

    def turned(self, frame: Frame, name: str) -> float | None:
        """Return by how much an object has turned about z [rad] since it was first seen.

        ``None`` where the frame does not show it.
        """
        if frame.objects is None or name not in frame.objects:
            return None
        first = next(f.objects[name] for f in self.frames if f.objects and name in f.objects)
        return heading(frame.objects[name], first)

    def finger(self, name: str) -> RecordedFinger:
        """Return the finger of that name.

        Raises:
            UnknownName: There is none.
        """
        for finger in self.fingers:
            if finger.name == name:
                return finger
        raise UnknownName("finger", name, [f.name for f in self.fingers])

    def objects_at(self, frame: Frame) -> tuple[SolidObject, ...]:
        """Return the objects present in a frame, at their poses there."""
        if frame.objects is None:
            return self.objects
        return tuple(
            replace(o, pose=frame.objects[o.name]) for o in self.objects if o.name in frame.objects
        )


def _contact(place: str, contact: Contact, last_disk: int) -> Contact:
    if contact.point not in CONTACT_POINTS:
        raise InvalidValue(f"{place}.point", contact.point, f"one of {', '.join(CONTACT_POINTS)}")
    return Contact(
        disk=checks.integer(f"{place}.disk", contact.disk, low=0, high=last_disk),
        point=contact.point,
        cable=str(contact.cable),
        obstacle=str(contact.obstacle),
        position=array(f"{place}.position", contact.position, (3,), "m"),
        normal=checks.direction(f"{place}.normal", contact.normal),
        force=checks.real(f"{place}.force", contact.force, low=0),
    )


def _unique(place: str, names: list[str]) -> None:
    for i, name in enumerate(names):
        if name in names[:i]:
            raise InvalidValue(f"{place}[{i}].name", name, "unique in its recording")
