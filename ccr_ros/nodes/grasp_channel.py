# SPDX-License-Identifier: Apache-2.0
"""The object in mode gripper of the solver node: in one equilibrium with all fingers."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import replace

from ccr_msgs.msg import GraspState
from geometry_msgs.msg import PoseStamped
from rclpy.clock import Clock
from rclpy.node import Node
from std_msgs.msg import Header
from tf2_ros import TransformBroadcaster

from ccr_ros.grasp.live import LiveGrasp
from ccr_ros.grasp.statics import Body, GraspSolution, GraspSolver, ObjectContact
from ccr_ros.model import Finger, InvalidValue, MountedFinger, Obstacle, Solution
from ccr_ros.viz.solids import SolidObject

from .backlog import Backlog
from .conversions import pose_message, transform_message
from .finger_channel import FingerChannel, Task
from .grasp_conversions import grasp_message, no_object, unsolved_object
from .object_conversions import SceneObject
from .pace import Pace
from .parameters import SolverParameters
from .qos import LATCHED
from .quality_watch import QualityWatch

_TIMES_KEPT = 1000  # solve times, for the percentiles
_WARN_EVERY = 2.0  # s
_PLAN_STEP = 0.3  # s of CPU; so long may live pulls have to wait for a solve of a plan


class GraspChannel:
    """Solves fingers and object together, when told to, and publishes what becomes of the object.

    While there is no object, or none that they reach any more, there is nothing here to solve: the
    fingers go on by themselves.

    Args:
        node: The node to make the topics on.
        fingers: Its fingers, in the gripper's order.
        fixed: Its parameters.
        broadcaster: For the object's transform.
        clock: Of the rates of what is told.
    """

    def __init__(
        self,
        node: Node,
        fingers: Sequence[FingerChannel],
        fixed: SolverParameters,
        broadcaster: TransformBroadcaster,
        clock: Clock,
    ) -> None:
        self._node = node
        self._fingers = tuple(fingers)
        self._fixed = fixed
        self._broadcaster = broadcaster
        self._log = node.get_logger().get_child("grasp")
        self._object: SceneObject | None = None
        self._live: LiveGrasp | None = None
        self._backlog = Backlog()
        self._stamp = node.get_clock().now().to_msg()  # of the last good pose
        self._told: object = None  # what was last told
        self._outdated = False  # whether there are other things around than the live object knows
        self._stability: tuple[bool, float] | None = None  # of the last pose that was judged
        self.doubt = ""  # why that is not stable
        self.solve_times: deque[float] = deque(maxlen=_TIMES_KEPT)
        self.solves = self.failures = 0
        self._state = node.create_publisher(GraspState, "grasp_state", LATCHED)
        self._pose = node.create_publisher(PoseStamped, "object_pose", LATCHED)
        self._quality = QualityWatch(fixed.gravity, self._log)
        self._pace = Pace(node, fixed.grasp_state_rate, clock, self._publish_state)
        self._slow_pace = Pace(node, fixed.quality_rate, clock, self._measure)

    @property
    def active(self) -> bool:
        """Whether there is an object, and all fingers are solved with it."""
        return self._live is not None and not self._live.lost

    @property
    def live(self) -> LiveGrasp | None:
        """The object and what became of it; None: there is no object."""
        return self._live

    @property
    def by_name(self) -> dict[str, Finger]:
        """The fingers by name."""
        return {channel.finger.name: channel.finger for channel in self._fingers}

    @property
    def fault(self) -> str:
        """Why object and fingers are not as wanted; empty: they are."""
        if self._live is None:
            return ""
        refused = "; ".join(f"{c.finger.name}: {c.fault}" for c in self._fingers if c.fault)
        return self._live.failure or refused or self._live.refusal

    @property
    def contacts(self) -> tuple[ObjectContact, ...]:
        """Where fingers press on the object, in the gripper's frame."""
        return () if self._shown is None else self._shown.contacts

    @property
    def _shown(self) -> GraspSolution | None:
        """The last good pose, as long as it says where the object is."""
        return self._live.solution if self._live is not None and self.active else None

    def seen(self, objects: Sequence[SceneObject]) -> list[SolidObject]:
        """Return what objects look like, the one in hand where it is."""
        return [
            item.seen_at(self._live.body.pose)
            if self._live is not None and item is self._object
            else item.solid
            for item in objects
        ]

    # The scene

    def choose(self, objects: Sequence[SceneObject]) -> SceneObject | None:
        """Return the object of a scene that is in hand, or None.

        Raises:
            InvalidValue: There are several that may be meant, or its name is a finger's frame.
        """
        wanted = self._fixed.object_name
        if wanted:
            chosen = [item for item in objects if item.name == wanted]
        else:
            chosen = [item for item in objects if item.mass > 0 or item.held]
        if len(chosen) > 1:
            names = ", ".join(item.name for item in chosen)
            allowed = "one that has a mass or is held; the parameter 'object' says which is meant"
            raise InvalidValue("objects", names, allowed)
        if not chosen:
            return None
        frame = self._frame(chosen[0])
        if frame in self._taken_frames() or frame.startswith("/"):
            allowed = f"a name that gives a new frame, without '/' at its start (not {frame!r})"
            raise InvalidValue("objects.name", chosen[0].name, allowed)
        return chosen[0]

    def take(self, item: SceneObject | None, anew: bool) -> bool:
        """Take the object of a new scene; return whether something is to be solved for it.

        Args:
            item: The object, or None where there is none any more.
            anew: Whether what else is there is different: the fingers' obstacles.

        Raises:
            InvalidValue: It is in a finger's base, or cannot be solved; nothing has changed.
        """
        if item is None:
            gone = self._live is not None
            self._live = self._object = None
            self._outdated = False
            return gone
        before = self._object
        try:
            body = Body(item.shape, item.mass, item.pose, item.friction)
        except InvalidValue as error:
            raise error.located(f"objects.{item.name}") from None
        live = self._live if before is not None and before.name == item.name else None
        anew |= self._outdated or before is None or before.form != item.form
        if live is not None and live.lost and item.held:  # nobody knows where it is
            live.want(item.pose, item.mass, item.held)
            self._object, self._outdated = item, anew
            return False
        place = item.pose if live is None else live.place(item.pose, item.held)
        if live is None or not (live.held and item.held):
            for channel in self._fingers:
                shape = item.shape.moved(channel.base.inverse() @ place)
                channel.finger.check_clear_of_base(shape, f"objects.{item.name}")
        due = False
        if live is None or anew:
            fingers = [
                MountedFinger(replace(c.finger, obstacles=_others(c, item.name)), c.base)
                for c in self._fingers
            ]
            fixed = self._fixed
            live = LiveGrasp(fingers, body, fixed.settings, fixed.gravity, place, fixed.disks)
            self._quality.forget()
            self._stability, due = None, True
        due |= live.want(item.pose, item.mass, item.held)
        self._live, self._object, self._outdated = live, item, False
        return due

    def prepare(self, channel: FingerChannel) -> None:
        """Have a finger's own solver stand where the finger is, against an object that stands.

        Raises:
            InvalidValue: The fingers carry the object.
        """
        live = self._live
        if live is None or live.lost or channel.solution is None:
            return
        if not live.supported:
            allowed = "asked while no object is held: what one finger does moves object and fingers"
            raise InvalidValue("solve_pulls", live.body.name, allowed)
        here = live.body.shape.moved(channel.base.inverse() @ live.body.pose)
        channel.set_obstacles((*_others(channel, here.name), here))
        channel.solver.solve(channel.solution.pulls)

    def plan_solver(self) -> GraspSolver:
        """Return a solver to plan on, which stands where object and fingers are.

        Raises:
            InvalidValue: There is no object, the fingers do not carry it, or where it is is not
                known.
        """
        live = self._live
        if live is None or live.solution is None:
            raise InvalidValue("object", None, "one that the fingers carry; there is none")
        allowed = "asked while the fingers carry it"
        if not live.held:
            why = live.failure or live.refusal or "it stands"
            raise InvalidValue("object", live.body.name, f"{allowed} ({why})")
        if self._stale:
            raise InvalidValue("object", live.body.name, f"{allowed} and no pose is stale")
        return live.copy(_PLAN_STEP)

    # The worker

    def turn(self) -> bool:
        """Solve the newest pulls of all fingers, once all have come in; return whether it did.

        Pulls that are shown already are shown again.
        """
        due = any(channel.unsolved for channel in self._fingers)
        if due and self._backlog.settled(sum(c.received for c in self._fingers)):
            if not all(channel.shown for channel in self._fingers):
                self._solve()
                return True
            for channel in self._fingers:
                if channel.unsolved:
                    channel.show_again()
        return False

    def _solve(self) -> None:
        assert self._live is not None
        tasks = [channel.begin() for channel in self._fingers]
        names = [channel.finger.name for channel in self._fingers]
        newest = max(tasks, key=_arrival)
        pulls = {name: task.pulls for name, task in zip(names, tasks, strict=True)}
        found = self._live.solve(pulls)
        failure = self._live.failure
        self.solves += 1
        self.solve_times.append(found.solve_time)
        if self._live.lost:
            self._log.warning(f"{failure}; the fingers move by themselves until it stands again")
            for channel, task in zip(self._fingers, tasks, strict=True):
                channel.set_obstacles(_others(channel, self._live.body.name))
                channel.solve_again(task.stamp)
            return
        if failure:
            self.failures += 1
            self._log.warning(
                f"{failure} (the last good pose stays)", throttle_duration_sec=_WARN_EVERY
            )
            for channel, task in zip(self._fingers, tasks, strict=True):
                channel.fail(task, failure)
            return
        if self._stability is None or self._pace.free:
            self._judge(found)
        for channel, task, solution in zip(self._fingers, tasks, found.fingers, strict=True):
            task = replace(task, stamp=newest.stamp)
            channel.show(task, self._of_finger(channel, solution))

    def _judge(self, solution: GraspSolution) -> None:
        """Find out whether a pose is stable; as this takes time, not of every one."""
        self._stability = solution.stable, solution.smallest_eigenvalue
        self.doubt = "" if solution.stable else solution.message

    def _of_finger(self, channel: FingerChannel, solution: Solution) -> Solution:
        """What the finger's topics show: its certificate is that of the whole."""
        assert self._stability is not None
        stable, eigenvalue = self._stability
        certificate = replace(
            solution.certificate, stable=stable, smallest_eigenvalue=eigenvalue, message=self.doubt
        )
        return replace(solution, finger=channel.finger, certificate=certificate)

    # What is told

    def tell(self) -> None:
        """Publish what is new of the object: its pose at once, its state as fast as it may."""
        newest = max((channel.accepted for channel in self._fingers), key=_arrival)
        fault, stale = self.fault, self._stale
        name = None if self._object is None else self._object.name
        told = (newest.arrived, fault, stale, name)
        if told == self._told:
            return
        self._told = told
        if not stale:
            self._stamp = newest.stamp
            self._publish_pose()
        self._slow_pace.changed()
        self._pace.changed()

    @property
    def _stale(self) -> bool:
        if self._live is None:
            return False
        return bool(self._live.failure) or any(channel.stale for channel in self._fingers)

    def _publish_pose(self) -> None:
        if self._live is None or self._object is None or self._live.solution is None:
            return
        pose = self._live.solution.body.pose
        header = Header(stamp=self._stamp, frame_id=self._fixed.gripper_frame)
        message = pose_message(pose.position, pose.orientation)
        self._pose.publish(PoseStamped(header=header, pose=message))
        self._broadcaster.sendTransform(
            transform_message(header.stamp, header.frame_id, self._frame(self._object), pose)
        )

    def _measure(self) -> None:
        if self._shown is not None:
            self._quality.measure(self._shown)
            self._pace.changed()

    def _publish_state(self) -> None:
        header = Header(stamp=self._stamp, frame_id=self._fixed.gripper_frame)
        live, shown = self._live, self._shown
        if live is None:
            self._state.publish(no_object(header))
        elif shown is None:
            self._state.publish(unsolved_object(header, live.body, self.fault))
        else:
            self._judge(shown)
            message = self.fault or self.doubt
            quality = self._quality.message(shown)
            self._state.publish(
                grasp_message(header, shown, quality, live.held, self._stale, message)
            )

    def _frame(self, item: SceneObject) -> str:
        return f"{self._fixed.frame_prefix}{item.name}"

    def _taken_frames(self) -> set[str]:
        frames = [channel.frames for channel in self._fingers]
        return {name for f in frames for name in (f.gripper, f.base, f.tip)}


def _others(channel: FingerChannel, name: str) -> tuple[Obstacle, ...]:
    """What is in a finger's way but the object of this name, in its base frame."""
    return tuple(obstacle for obstacle in channel.solver.obstacles if obstacle.name != name)


def _arrival(task: Task) -> float:
    return task.arrived
