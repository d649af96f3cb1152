# SPDX-License-Identifier: Apache-2.0
"""Markers of a gripper for RViz and the like: fingers, contacts and objects as one MarkerArray.

Every message is the whole scene, so that a latched topic shows it to who joins late. Namespaces
and ids stay with what they show; a marker whose subject is gone is deleted in every message until
its id is taken again, so that a viewer that missed one message keeps no ghosts.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from ..model import Contact, Finger, Solution
from .shapes import triangles
from .solids import SolidObject

if TYPE_CHECKING:
    from ..grasp.statics import ObjectContact

DISK_THICKNESS = 0.002  # m
DISK_RIM = 0.0015  # m, of the disk outside its holes
CABLE_WIDTH = 0.001  # m
CONTACT_SIZE = 0.005  # m
CENTERLINE_STEP = 2  # every so many points of the dense centerline

# Forces are shown relative to EI / L^2, the finger's own scale: right for newtons and per EI.
ARROW_PER_FORCE = 0.02  # finger lengths per EI / L^2
LONGEST_ARROW = 0.5  # finger lengths
HALF_COLOUR_TENSION = 20.0  # EI / L^2; a cable of this tension is halfway to the last colour

BACKBONE = (0.90, 0.90, 0.86, 1.0)
DISK = (0.35, 0.45, 0.60, 1.0)
SLACK = (0.55, 0.55, 0.55, 1.0)
CALM, TENSE = (0.15, 0.65, 0.85), (0.95, 0.20, 0.10)
CONTACT = (0.95, 0.10, 0.55, 1.0)
FORCE = (0.95, 0.60, 0.05, 1.0)
STICK, SLIP = (0.20, 0.80, 0.70, 1.0), (0.95, 0.85, 0.20, 1.0)  # friction of contacts that do
OBJECT = (0.30, 0.75, 0.35, 0.45)
OBSTACLE = (0.60, 0.60, 0.60, 0.35)
STALE_ALPHA = 0.35  # a pose that is not that of the newest pulls is see-through

_CORNERS: dict[Hashable, list[Point]] = {}
_MOST_SHAPES = 32


@dataclass(frozen=True, eq=False)
class FingerView:
    """What is to be shown of a finger.

    Attributes:
        solution: Its pose.
        frame: tf frame of its base, in which the pose is.
        stale: Whether the pose is out of date.
    """

    solution: Solution
    frame: str
    stale: bool = False


class SceneMarkers:
    """Makes the marker message of a scene, and remembers which ids stand for what."""

    def __init__(self) -> None:
        self._slots: dict[str, dict[Hashable, int]] = {}
        self._used: dict[str, int] = {}  # ids 0 .. used - 1 of a namespace have been shown
        self._fingers: dict[str, tuple[FingerView, list[Marker]]] = {}

    def message(
        self,
        fingers: Iterable[FingerView],
        objects: Sequence[SolidObject],
        gripper_frame: str,
        grasp: Sequence[ObjectContact] = (),
    ) -> MarkerArray:
        """Return the whole scene.

        Args:
            fingers: The fingers that have a pose.
            objects: In the gripper's frame.
            gripper_frame: tf frame of the gripper.
            grasp: Contacts of which friction is shown, in the gripper's frame.
        """
        markers: list[Marker] = []
        known = {}
        for view in fingers:
            markers += self._finger(view)
            known[view.solution.finger.name] = view.solution.finger
        rubbing = {
            (c.finger, c.disk, c.point, c.cable): c
            for c in grasp
            if c.finger in known and np.any(c.friction_force)
        }
        markers += self._slotted(
            "friction", gripper_frame, rubbing, lambda c: _friction_arrow(c, known[c.finger])
        )
        markers += self._bodies("objects", gripper_frame, objects, OBJECT)
        return MarkerArray(markers=markers)

    def clear(self) -> MarkerArray:
        """Return the message that takes everything away; forget all ids."""
        self._slots.clear()
        self._used.clear()
        self._fingers.clear()
        return MarkerArray(markers=[Marker(action=Marker.DELETEALL)])

    def _finger(self, view: FingerView) -> list[Marker]:
        name = view.solution.finger.name
        before = self._fingers.get(name)
        # A message is costly to make, and most often one finger of several has moved.
        if before and before[0].solution is view.solution and before[0].stale == view.stale:
            return before[1]
        finger, solution = view.solution.finger, view.solution
        markers = [_backbone(view), *_disks(view), *_cables(view)]
        contacts = {(c.disk, c.point, c.cable, c.obstacle): c for c in solution.contacts}
        markers += self._slotted(f"{name}/contacts", view.frame, contacts, _contact_point)
        markers += self._slotted(
            f"{name}/forces", view.frame, contacts, lambda contact: _force_arrow(contact, finger)
        )
        bodies = [SolidObject.from_obstacle(o) for o in finger.obstacles]
        markers += self._bodies(f"{name}/obstacles", view.frame, bodies, OBSTACLE)
        self._fingers[name] = (view, markers)
        return markers

    def _bodies(
        self,
        namespace: str,
        frame: str,
        bodies: Sequence[SolidObject],
        colour: tuple[float, float, float, float],
    ) -> list[Marker]:
        subjects = {body.name: body for body in bodies}
        return self._slotted(namespace, frame, subjects, lambda body: _body(body, colour))

    def _slotted(
        self,
        namespace: str,
        frame: str,
        subjects: Mapping[str, Any] | Mapping[tuple, Any],
        make: Callable[[Any], Marker],
    ) -> list[Marker]:
        """Return one marker per subject, with the id it had before, and deletions of the rest."""
        slots = self._slots.setdefault(namespace, {})
        for gone in slots.keys() - subjects.keys():
            del slots[gone]
        taken = set(slots.values())
        free = (i for i in itertools.count() if i not in taken)
        markers = []
        for key, subject in subjects.items():
            if key not in slots:
                slots[key] = next(free)
            marker = make(subject)
            marker.ns, marker.id, marker.header.frame_id = namespace, slots[key], frame
            marker.frame_locked = True
            markers.append(marker)
        shown = set(slots.values())
        used = self._used[namespace] = max([self._used.get(namespace, 0), *(i + 1 for i in shown)])
        for vacant in sorted(set(range(used)) - shown):
            marker = Marker(ns=namespace, id=vacant, action=Marker.DELETE)
            marker.header.frame_id = frame
            markers.append(marker)
        return markers


def _marker(view: FingerView, part: str, number: int, kind: int) -> Marker:
    # No stamp: with frame_locked, viewers put it at the newest pose of its frame.
    marker = Marker(ns=f"{view.solution.finger.name}/{part}", id=number, type=kind)
    marker.header.frame_id = view.frame
    marker.frame_locked = True
    return marker


def _backbone(view: FingerView) -> Marker:
    marker = _marker(view, "backbone", 0, Marker.LINE_STRIP)
    marker.scale.x = view.solution.finger.backbone_diameter
    marker.color = _colour(BACKBONE, view.stale)
    dense = view.solution.centerline
    marker.points = _points([*dense[:-1:CENTERLINE_STEP], dense[-1]])
    return marker


def _disks(view: FingerView) -> list[Marker]:
    solution = view.solution
    diameter = 2.0 * (solution.finger.disk_radius + DISK_RIM)
    colour = _colour(DISK, view.stale)
    markers = []
    for i, (point, turn) in enumerate(zip(solution.backbone, solution.quaternions, strict=True)):
        marker = _marker(view, "disks", i, Marker.CYLINDER)
        marker.pose = _pose(point, turn)
        marker.scale = Vector3(x=diameter, y=diameter, z=DISK_THICKNESS)
        marker.color = colour
        markers.append(marker)
    return markers


def _cables(view: FingerView) -> list[Marker]:
    solution = view.solution
    finger = solution.finger
    unit = _force_unit(finger)
    markers = []
    for j, (name, tension) in enumerate(zip(finger.cable_names, solution.tensions, strict=True)):
        marker = _marker(view, "cables", j, Marker.LINE_STRIP)
        marker.scale.x = CABLE_WIDTH
        marker.color = _colour(tension_colour(float(tension) / unit), view.stale)
        marker.points = _points(solution.cables[name])
        markers.append(marker)
    return markers


def tension_colour(tension: float) -> tuple[float, float, float, float]:
    """Return the colour of a cable: grey when slack, else from blue to red with its tension.

    Args:
        tension: In units of EI / L^2 of its finger.
    """
    if tension <= 0.0:
        return SLACK
    share = tension / (tension + HALF_COLOUR_TENSION)
    r, g, b = (a + share * (z - a) for a, z in zip(CALM, TENSE, strict=True))
    return r, g, b, 1.0


def _contact_point(contact: Contact) -> Marker:
    marker = Marker(type=Marker.SPHERE, color=_colour(CONTACT))
    marker.pose = _pose(contact.position, (0.0, 0.0, 0.0, 1.0))
    marker.scale = Vector3(x=CONTACT_SIZE, y=CONTACT_SIZE, z=CONTACT_SIZE)
    return marker


def _force_arrow(contact: Contact, finger: Finger) -> Marker:
    """Return the force on the finger, as an arrow from where it acts."""
    return _arrow(contact.position, contact.force * contact.normal, finger, FORCE)


def _friction_arrow(contact: ObjectContact, finger: Finger) -> Marker:
    """Return the friction on the finger, on the scale of the other forces."""
    colour = SLIP if contact.status == "slip" else STICK
    return _arrow(contact.position, contact.friction_force, finger, colour)


def _arrow(
    position: np.ndarray,
    force: np.ndarray,
    finger: Finger,
    colour: tuple[float, float, float, float],
) -> Marker:
    size = float(np.linalg.norm(force))
    length = finger.length * min(ARROW_PER_FORCE * size / _force_unit(finger), LONGEST_ARROW)
    marker = Marker(type=Marker.ARROW, color=_colour(colour))
    marker.points = _points([position, position + (length / size if size else 0.0) * force])
    marker.scale = Vector3(x=CONTACT_SIZE / 3, y=CONTACT_SIZE * 0.7, z=0.0)
    return marker


def _body(body: SolidObject, colour: tuple[float, float, float, float]) -> Marker:
    marker = Marker(color=_colour(colour), pose=_pose(body.pose.position, body.pose.orientation))
    if body.kind == "sphere":
        diameter = 2.0 * body.dimensions[0]
        marker.type, marker.scale = Marker.SPHERE, Vector3(x=diameter, y=diameter, z=diameter)
    elif body.kind == "box":
        x, y, z = body.dimensions
        marker.type, marker.scale = Marker.CUBE, Vector3(x=x, y=y, z=z)
    elif body.kind == "cylinder":
        height, radius = body.dimensions
        marker.type, marker.scale = Marker.CYLINDER, Vector3(x=2 * radius, y=2 * radius, z=height)
    else:  # viewers know no capsules, and a mesh resource would have to be a file of theirs
        marker.type, marker.scale = Marker.TRIANGLE_LIST, Vector3(x=1.0, y=1.0, z=1.0)
        marker.points = _corners(body)
    return marker


def _corners(body: SolidObject) -> list[Point]:
    """Return the corners of a body's triangles; they stay while it moves, and are kept."""
    if body.shape not in _CORNERS:
        if len(_CORNERS) >= _MOST_SHAPES:
            _CORNERS.clear()
        _CORNERS[body.shape] = _points(triangles(body).reshape(-1, 3))
    return _CORNERS[body.shape]


def _force_unit(finger: Finger) -> float:
    return finger.bending_stiffness / finger.length**2


def _colour(rgba: tuple[float, float, float, float], stale: bool = False) -> ColorRGBA:
    r, g, b, a = rgba
    return ColorRGBA(r=r, g=g, b=b, a=STALE_ALPHA if stale else a)


def _points(points: Iterable[np.ndarray]) -> list[Point]:
    return [Point(x=float(x), y=float(y), z=float(z)) for x, y, z in points]


def _pose(position: Iterable[float], orientation: Iterable[float]) -> Pose:
    x, y, z = map(float, position)
    qx, qy, qz, qw = map(float, orientation)
    return Pose(position=Point(x=x, y=y, z=z), orientation=Quaternion(x=qx, y=qy, z=qz, w=qw))
