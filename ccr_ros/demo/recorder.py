# SPDX-License-Identifier: Apache-2.0
"""demo_recorder: hears what the nodes publish; records it and measures it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from builtin_interfaces.msg import Time as TimeMessage
from ccr_msgs.msg import (
    CablePulls,
    FingerState,
    GraspState,
    GripperState,
    ObjectArray,
    ServoState,
)
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Point, PoseArray, PoseStamped
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from ccr_ros.model import CcrError, Contact, FingerSolver, Gripper
from ccr_ros.nodes.object_conversions import objects_from_message
from ccr_ros.nodes.qos import (
    COMMAND,
    COMMAND_QUEUE,
    DIAGNOSTICS,
    JOINT_STATES,
    LATCHED,
    reliable,
)
from ccr_ros.stack.bag import BagWriter, record_topic
from ccr_ros.viz.recording import Recording
from ccr_ros.viz.recording_builder import RecordingBuilder
from ccr_ros.viz.solids import SolidObject

from .measurements import Measurements
from .objects_seen import ObjectsSeen

_FRAMES_PER_SECOND = 25.0
_WARN_EVERY = 2.0  # s

# Deep enough that nothing is lost, and counted wrongly, while this process is busy.
_POSES = reliable(depth=100, latched=True)
_MAX_PARTIAL = 20  # poses of which some messages have come, per finger


@dataclass(frozen=True)
class Glimpse:
    """One finger, just now.

    Attributes:
        pull: Of its first cable [% of the rest length].
        tension: Of its first cable [N].
        force: Sum of its contact forces [N].
    """

    pull: float
    tension: float
    force: float


class Recorder(Node):
    """Puts the messages of each pose together again and takes frames at an even rate.

    Frames, and what is measured, count from `begin` on.

    Args:
        gripper: The gripper of the solver node in the same namespace.
        bag: Where all topics are recorded as they are, or None.
        support: What stands under the object while the fingers do not carry it: it is only drawn.
        options: Of `rclpy.node.Node`.

    Attributes:
        measurements: What was measured so far.
        state_count: Number of states received so far.
    """

    def __init__(
        self,
        gripper: Gripper,
        bag: BagWriter | None = None,
        support: Sequence[SolidObject] = (),
        **options: Any,
    ) -> None:
        super().__init__("demo_recorder", **options)
        self._gripper = gripper
        lengths = {m.finger.name: FingerSolver(m.finger).rest_lengths for m in gripper.fingers}
        self._lengths = lengths
        self._bases = {m.finger.name: m.base for m in gripper.fingers}
        self._builder = RecordingBuilder.of_gripper(gripper, rest_lengths=lengths)
        self.measurements = Measurements(gripper.finger_names)
        self.state_count = 0
        self._states: dict[str, FingerState] = {}
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._start: float | None = None  # steady clock [s]
        # By finger and stamp: the messages of one pose that have arrived, by topic.
        self._partial: dict[str, dict[int, dict[str, Any]]] = {n: {} for n in lengths}
        self._posed: set[str] = set()  # fingers of which a whole pose has arrived

        for mounted in gripper.fingers:
            name = mounted.finger.name
            heard = partial(self._pulls_heard, name)
            self.create_subscription(CablePulls, f"{name}/cable_pulls", heard, COMMAND_QUEUE)
            heard = partial(self._state_heard, name)
            self.create_subscription(FingerState, f"{name}/state", heard, _POSES)
            for topic in ("backbone", *(f"cables/{c}" for c in mounted.finger.cable_names)):
                heard = partial(self._part_heard, name, topic)
                self.create_subscription(PoseArray, f"{name}/{topic}", heard, _POSES)
        # Of each servo: its finger, and the place of its cable there.
        self._joints = {
            f"{m.finger.name}_{cable}": (m.finger.name, j)
            for m in gripper.fingers
            for j, cable in enumerate(m.finger.cable_names)
        }
        self.create_subscription(JointState, "joint_states", self._joints_heard, JOINT_STATES)
        self._seen = ObjectsSeen(support)
        self.create_subscription(ObjectArray, "objects", self._objects_heard, LATCHED)
        self.create_subscription(GraspState, "grasp_state", self._grasp_heard, LATCHED)
        self.create_subscription(PoseStamped, "object_pose", self._object_moved, LATCHED)
        # Counted, not looked at: left undecoded.
        self.create_subscription(MarkerArray, "markers", self._markers_heard, LATCHED, raw=True)
        self.create_timer(1.0 / _FRAMES_PER_SECOND, self._sample, clock=self._steady)
        if bag is not None:
            for kind, topic, qos in _topics(gripper):
                record_topic(self, bag, kind, topic, qos)

    def begin(self) -> None:
        """Start to take frames and to measure."""
        if self._start is None:
            self._start = self._now()

    def set_phase(self, phase: str) -> None:
        """Say what is going on from now on, in a few words."""
        self._builder.set_phase(phase)

    @property
    def elapsed(self) -> float | None:
        """Time since the beginning [s]; ``None`` before it."""
        return None if self._start is None else self._now() - self._start

    @property
    def complete(self) -> bool:
        """Whether the state of every finger has been heard."""
        return len(self._states) == len(self._bases)

    def rivals(self) -> list[str]:
        """Return the topics that more than one node publishes: another solver is in the way."""
        topics = [f"{name}/state" for name in self._bases]
        return [self.resolve_topic_name(t) for t in topics if self.count_publishers(t) > 1]

    def glimpses(self) -> Mapping[str, Glimpse]:
        """Return what each finger that has been heard does now, by name."""
        return {
            name: Glimpse(
                pull=100.0 * state.pulls[0] / float(self._lengths[name][0]),
                tension=state.tensions[0],
                force=sum(contact.force for contact in state.contacts),
            )
            for name, state in self._states.items()
        }

    def recording(self) -> Recording:
        """Return what was recorded, from the beginning on.

        Raises:
            InvalidValue: No poses were heard since.
        """
        return self._builder.build()

    def _now(self) -> float:
        return self._steady.now().nanoseconds * 1e-9

    def _pulls_heard(self, finger: str, message: CablePulls) -> None:
        if self._start is not None:
            self.measurements.add_pulls(finger, _nanoseconds(message.header.stamp))

    def _state_heard(self, finger: str, message: FingerState) -> None:
        arrival = self.get_clock().now().nanoseconds
        self.state_count += 1
        self._states[finger] = message
        self.measurements.add_state(
            finger,
            _nanoseconds(message.header.stamp),
            arrival,
            solve_time=message.certificate.solve_time,
            stable=message.certificate.stable,
            stale=message.stale,
            touching={contact.obstacle for contact in message.contacts},
            force=max((contact.force for contact in message.contacts), default=0.0),
        )
        self._part_heard(finger, "state", message)

    def _part_heard(self, finger: str, topic: str, message: Any) -> None:
        """Keep a message until the others of the same pose have come, in whatever order."""
        partial_poses = self._partial[finger]
        stamp = _nanoseconds(message.header.stamp)
        parts = partial_poses.setdefault(stamp, {})
        parts[topic] = message
        cables = parts["state"].cables if "state" in parts else None
        if cables is None or len(parts) < 2 + len(cables):
            while len(partial_poses) > _MAX_PARTIAL:
                del partial_poses[min(partial_poses)]
            return
        for older in [known for known in partial_poses if known <= stamp]:
            del partial_poses[older]
        self._add(finger, parts["state"], parts["backbone"], parts)

    def _add(
        self, finger: str, state: FingerState, backbone: PoseArray, parts: Mapping[str, PoseArray]
    ) -> None:
        self._posed.add(finger)
        self._builder.add(
            finger,
            pulls=state.pulls,
            tensions=state.tensions,
            backbone=_points(backbone),
            orientations=[
                (q.x, q.y, q.z, q.w) for q in (pose.orientation for pose in backbone.poses)
            ],
            cables={name: _points(parts[f"cables/{name}"]) for name in state.cables},
            contacts=[
                Contact(
                    disk=contact.disk,
                    point=contact.point,
                    cable=contact.cable,
                    obstacle=contact.obstacle,
                    position=_vector(contact.position),
                    normal=_vector(contact.normal),
                    force=contact.force,
                )
                for contact in state.contacts
            ],
            converged=state.certificate.converged,
            stable=state.certificate.stable,
            stale=state.stale,
        )

    def _joints_heard(self, message: JointState) -> None:
        angles: dict[str, dict[int, float]] = {}
        for joint, angle in zip(message.name, message.position, strict=False):
            if joint in self._joints:
                finger, cable = self._joints[joint]
                angles.setdefault(finger, {})[cable] = angle
        for finger, known in angles.items():
            if len(known) == len(self._lengths[finger]):
                self._builder.add(finger, servo_angles=[known[j] for j in range(len(known))])

    def _objects_heard(self, message: ObjectArray) -> None:
        try:
            objects = objects_from_message(message, message.header.frame_id)
            self._seen.take_objects([item.solid for item in objects])
            self._builder.set_objects(self._seen.bodies())
        except CcrError as error:
            self.get_logger().warning(
                f"objects not recorded: {error}", throttle_duration_sec=_WARN_EVERY
            )

    def _grasp_heard(self, message: GraspState) -> None:
        self._builder.set_grip(self._seen.take_grasp(message))
        self._builder.set_objects(self._seen.bodies())

    def _object_moved(self, message: PoseStamped) -> None:
        self._seen.take_pose(message.pose)
        self._builder.set_objects(self._seen.bodies())

    def _markers_heard(self, _: bytes) -> None:
        self.measurements.markers += 1

    def _sample(self) -> None:
        # A state is heard before the rest of its pose: a frame waits for all of every finger.
        if self._start is not None and len(self._posed) == len(self._bases):
            self._builder.sample(self._now())


def _topics(gripper: Gripper) -> list[tuple[type, str, QoSProfile]]:
    """All that the nodes of a gripper publish, with what it is published as."""
    topics: list[tuple[type, str, QoSProfile]] = [
        (ObjectArray, "objects", LATCHED),
        (GraspState, "grasp_state", LATCHED),
        (PoseStamped, "object_pose", LATCHED),
        (MarkerArray, "markers", LATCHED),
        (GripperState, "gripper_state", LATCHED),
        (ServoState, "servo_state", LATCHED),
        (JointState, "joint_states", JOINT_STATES),
        (Float64MultiArray, "servo_commands", COMMAND),
        (TFMessage, "/tf", reliable(depth=100)),
        (TFMessage, "/tf_static", LATCHED),
        (DiagnosticArray, "/diagnostics", DIAGNOSTICS),
    ]
    for mounted in gripper.fingers:
        name = mounted.finger.name
        topics += [
            (CablePulls, f"{name}/cable_pull_commands", COMMAND),
            (CablePulls, f"{name}/cable_pulls", COMMAND),
            (FingerState, f"{name}/state", LATCHED),
            (PoseArray, f"{name}/backbone", LATCHED),
            *((PoseArray, f"{name}/cables/{c}", LATCHED) for c in mounted.finger.cable_names),
        ]
    return topics


def _nanoseconds(stamp: TimeMessage) -> int:
    return stamp.sec * 1_000_000_000 + stamp.nanosec


def _vector(point: Point) -> np.ndarray:
    return np.array([point.x, point.y, point.z])


def _points(poses: PoseArray) -> np.ndarray:
    return np.array([(pose.position.x, pose.position.y, pose.position.z) for pose in poses.poses])
