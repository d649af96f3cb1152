# SPDX-License-Identifier: Apache-2.0
"""demo_ball: in place of a real ball between the fingers; tells where it is on ``objects``.

On its stand the ball keeps its place. Without the stand it goes where fingers and weight leave it
(`ccr_ros.grasp.statics`); when they cannot hold it, it is back on the stand.
"""

from __future__ import annotations

import time
from functools import partial
from typing import Any

from ccr_msgs.msg import CablePulls, Object, ObjectArray
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter
from shape_msgs.msg import SolidPrimitive
from std_msgs.msg import Header

from ccr_ros.grasp.statics import GraspSolver, sphere_body
from ccr_ros.model import CcrError, Pose, SolverSettings, load_gripper
from ccr_ros.nodes.conversions import pose_message, pulls_from_message
from ccr_ros.nodes.qos import COMMAND, LATCHED
from ccr_ros.resources import find_config

from .scene import BALL, DIAMETER, GRIPPER_FILE, LIGHT, ON_STAND

MASS, SUPPORTED = "mass", "supported"
_RATE = 20.0  # Hz, of looking whether something has changed
_SHARE = 3.0  # times as long as it took to settle, the node has for other things
_TIME_LIMIT = 0.3  # s of CPU, to settle
_TELL_EVERY = 20  # looks, when nothing has
_STILL = 2e-6  # m of pull; below this nothing has changed


class BallNode(Node):
    """A ball that obeys statics.

    Args:
        options: Of `rclpy.node.Node`.

    Raises:
        CcrError: The gripper file is not valid.
        rclpy.exceptions.ParameterException: A parameter is of the wrong type or out of range.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("demo_ball", **options)
        file = self.declare_parameter(
            "gripper_file",
            GRIPPER_FILE,
            ParameterDescriptor(description="The solver node's gripper file.", read_only=True),
        ).value
        self.declare_parameter(
            MASS,
            LIGHT,
            ParameterDescriptor(
                description="Mass of the ball [kg].",
                floating_point_range=[FloatingPointRange(from_value=0.0, to_value=1.0, step=0.0)],
            ),
        )
        self.declare_parameter(
            SUPPORTED, True, ParameterDescriptor(description="Whether the ball is on its stand.")
        )
        self._gripper = load_gripper(find_config(str(file)))
        self._body = sphere_body(DIAMETER, LIGHT, ON_STAND)
        self._held: GraspSolver | None = None  # None: on the stand
        self._pulls: dict[str, Any] = {}
        self._solved: dict[str, Any] = {}
        self._mass = LIGHT
        self._looks = 0
        self._rests_until = 0.0  # monotonic [s]
        for mounted in self._gripper.fingers:
            heard = partial(self._pulls_heard, mounted.finger)
            topic = f"{mounted.finger.name}/cable_pulls"
            self.create_subscription(CablePulls, topic, heard, COMMAND)
        self._objects = self.create_publisher(ObjectArray, "objects", LATCHED)
        self.add_on_set_parameters_callback(self._may_change)
        self.create_timer(1.0 / _RATE, self._look)
        self._tell()

    def _pulls_heard(self, finger: Any, message: CablePulls) -> None:
        try:
            self._pulls[finger.name] = pulls_from_message(message, finger)
        except CcrError as error:
            self.get_logger().warning(f"pulls ignored: {error}", throttle_duration_sec=2.0)

    def _may_change(self, parameters: list[Parameter]) -> SetParametersResult:
        for parameter in parameters:
            if parameter.name == SUPPORTED and not parameter.value and self._held is None:
                problem = self._take_stand_away()
                if problem:
                    return SetParametersResult(successful=False, reason=problem)
            elif parameter.name == SUPPORTED and parameter.value:
                self._held = None
        return SetParametersResult(successful=True)

    def _take_stand_away(self) -> str:
        """Leave the ball to the fingers; return why that is not possible, or nothing."""
        missing = [n for n in self._gripper.finger_names if n not in self._pulls]
        if missing:
            return f"the pulls of {', '.join(missing)} are not known"
        settings = SolverSettings(time_limit=_TIME_LIMIT)
        solver = GraspSolver(self._gripper.fingers, self._body, settings)
        try:
            if not solver.solve(self._pulls, mass=self._mass).require_converged().contacts:
                return "no finger touches the ball"
            self._body = solver.let_go().require_converged().body
        except CcrError as error:
            return str(error)
        self._held, self._solved = solver, dict(self._pulls)
        self._tell()
        return ""

    def _look(self) -> None:
        """See whether pulls or mass have changed, and where the ball is then."""
        self._looks += 1
        mass = float(self.get_parameter(MASS).value)
        if self._held is None:
            changed = mass != self._mass
            self._mass = mass
        else:
            changed = mass != self._mass or any(
                abs(self._pulls[name] - self._solved[name]).max() > _STILL for name in self._pulls
            )
        if changed and self._held is not None:
            begin = time.monotonic()
            if begin < self._rests_until:
                return
            self._settle(mass)
            end = time.monotonic()
            self._rests_until = end + _SHARE * (end - begin)
        if changed or self._looks % _TELL_EVERY == 0:
            self._tell()

    def _settle(self, mass: float) -> None:
        assert self._held is not None
        pulls = dict(self._pulls)
        try:
            solution = self._held.solve(pulls, mass=mass)
        except CcrError as error:
            self.get_logger().warning(f"pulls ignored: {error}", throttle_duration_sec=2.0)
            return
        self._mass, self._solved = mass, pulls
        if solution.converged:
            self._body = solution.body
            return
        self.get_logger().warning("the fingers do not hold the ball any more; the stand catches it")
        self._held = None
        self._body = sphere_body(DIAMETER, mass, ON_STAND)
        self.set_parameters([Parameter(SUPPORTED, value=True)])

    def _tell(self) -> None:
        pose: Pose = self._body.pose
        ball = Object(
            name=BALL.name,
            primitive=SolidPrimitive(type=SolidPrimitive.SPHERE, dimensions=[DIAMETER / 2]),
            pose=pose_message(pose.position, pose.orientation),
            mass=self._mass,
        )
        stamp = self.get_clock().now().to_msg()
        self._objects.publish(ObjectArray(header=Header(stamp=stamp), objects=[ball]))
