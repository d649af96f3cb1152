# SPDX-License-Identifier: Apache-2.0
"""Building a recording from values that arrive at different times, as topics do."""

from __future__ import annotations

import threading
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ..model.errors import InvalidValue, UnknownName
from ..model.files import Gripper
from ..model.rotation import Pose
from ..model.solution import Contact, Solution
from .recorded_grasp import GripFrame
from .recording import FingerFrame, Frame, RecordedFinger, Recording, SolidObject

# What must have arrived before a finger can be shown at all.
_NEEDED = ("pulls", "tensions", "backbone", "orientations")


class RecordingBuilder:
    """Keeps the latest values of each finger, and takes them as a frame when told to.

    Feed it from subscriptions with `add` (any thread), call `sample` from a timer, and `build` at
    the end. A frame shows each finger from the first moment all of its pulls, tensions, backbone
    and orientations have arrived.
    """

    def __init__(
        self,
        gripper: str,
        fingers: Iterable[RecordedFinger],
        *,
        objects: Iterable[SolidObject] = (),
        forces_are: str = "newton",
    ) -> None:
        self._gripper = gripper
        self._fingers = tuple(fingers)
        self._forces_are = forces_are
        self._lock = threading.Lock()
        self._latest: dict[str, dict[str, Any]] = {f.name: {"cables": {}} for f in self._fingers}
        self._objects: dict[str, SolidObject] = {}
        self._present: dict[str, Pose] = {}
        self._frames: list[Frame] = []
        self._start: float | None = None
        self._phase = ""
        self._grip: GripFrame | None = None
        self.set_objects(objects)

    @classmethod
    def of_gripper(
        cls,
        gripper: Gripper,
        *,
        objects: Iterable[SolidObject] = (),
        rest_lengths: Mapping[str, Any] | None = None,
    ) -> RecordingBuilder:
        """Start a recording of a gripper read from its file.

        Args:
            gripper: The gripper.
            objects: What is there at the start.
            rest_lengths: (m,) cable lengths at rest [m] by finger name, for percentages.
        """
        units = {m.finger.forces_are for m in gripper.fingers}
        if len(units) > 1:
            raise InvalidValue(
                "fingers", sorted(units), "fingers that all give forces in the same unit"
            )
        fingers = [
            RecordedFinger(
                name=m.finger.name,
                base=m.base,
                disk_radius=m.finger.disk_radius,
                cables=m.finger.cable_names,
                backbone_diameter=m.finger.backbone_diameter,
                rest_lengths=tuple((rest_lengths or {}).get(m.finger.name, ())),
            )
            for m in gripper.fingers
        ]
        return cls(gripper.name, fingers, objects=objects, forces_are=units.pop())

    def __len__(self) -> int:
        """Return the number of frames taken."""
        return len(self._frames)

    def add(
        self,
        finger: str,
        *,
        pulls: Sequence[float] | np.ndarray | None = None,
        tensions: Sequence[float] | np.ndarray | None = None,
        backbone: Sequence[Any] | np.ndarray | None = None,
        orientations: Sequence[Any] | np.ndarray | None = None,
        cables: Mapping[str, Any] | None = None,
        contacts: Sequence[Contact] | None = None,
        converged: bool | None = None,
        stable: bool | None = None,
        stale: bool | None = None,
        servo_angles: Sequence[float] | np.ndarray | None = None,
    ) -> None:
        """Note what has arrived about a finger; what is not given keeps its last value.

        Args:
            finger: Its name.
            pulls, tensions, backbone, orientations, contacts, converged, stable, stale,
                servo_angles: As in `FingerFrame`, in the finger's base frame.
            cables: Points of one or more cables by name; the others keep theirs.

        Raises:
            UnknownName: No such finger.
        """
        if finger not in self._latest:
            raise UnknownName("finger", finger, self._latest)
        given = {
            "pulls": pulls,
            "tensions": tensions,
            "backbone": backbone,
            "orientations": orientations,
            "contacts": None if contacts is None else tuple(contacts),
            "converged": converged,
            "stable": stable,
            "stale": stale,
            "servo_angles": servo_angles,
        }
        with self._lock:
            latest = self._latest[finger]
            latest.update({k: v for k, v in given.items() if v is not None})
            latest["cables"] = {**latest["cables"], **(cables or {})}

    def add_solution(self, finger: str, solution: Solution, *, stale: bool = False) -> None:
        """Note a solved pose of a finger."""
        self.add(
            finger,
            pulls=solution.pulls,
            tensions=solution.tensions,
            backbone=solution.backbone,
            orientations=solution.quaternions,
            cables=solution.cables,
            contacts=solution.contacts,
            converged=solution.certificate.converged,
            stable=solution.certificate.stable,
            stale=stale,
        )

    def set_objects(self, objects: Iterable[SolidObject]) -> None:
        """Note the objects present from now on, at their poses; the others are gone.

        Raises:
            InvalidValue: A name that was used before now stands for a body of another shape.
        """
        objects = tuple(objects)
        with self._lock:
            for o in objects:
                known = self._objects.setdefault(o.name, o)
                if known.shape != o.shape:
                    was = f"{known.kind} {known.dimensions or ''}".rstrip()
                    raise InvalidValue(
                        f"objects.{o.name}", (o.kind, o.dimensions), f"as before: {was}"
                    )
            self._present = {o.name: o.pose for o in objects}

    def set_grip(self, grip: GripFrame | None) -> None:
        """Note what is known from now on of the object in the fingers."""
        with self._lock:
            self._grip = grip

    def set_phase(self, phase: str) -> None:
        """Note what the gripper is doing from now on, in a word or two."""
        with self._lock:
            self._phase = phase

    def sample(self, time: float) -> None:
        """Take the latest values as the frame of ``time`` [s], counted from any origin.

        A moment not later than the last frame's (a clock that was set back) is left out.

        Raises:
            InvalidValue: A value that was added is wrong.
        """
        with self._lock:
            latest = {name: dict(v) for name, v in self._latest.items()}
            present, phase, grip = dict(self._present), self._phase, self._grip
        start = time if self._start is None else self._start
        if self._frames and time - start <= self._frames[-1].time:
            return
        fingers = {n: FingerFrame(**v) for n, v in latest.items() if all(k in v for k in _NEEDED)}
        self._frames.append(Frame(time - start, fingers, present, phase, grip))
        self._start = start

    def build(self) -> Recording:
        """Return the recording, its time counted from the first frame.

        Raises:
            InvalidValue: No frame was taken, or one does not fit the fingers.
            UnknownName: A frame names an unknown cable.
        """
        return Recording(
            gripper=self._gripper,
            fingers=self._fingers,
            frames=tuple(self._frames),
            objects=tuple(self._objects.values()),
            forces_are=self._forces_are,
        )
