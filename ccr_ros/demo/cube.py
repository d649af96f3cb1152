# SPDX-License-Identifier: Apache-2.0
"""demo_cube: in place of a real cube on a small table; tells of it on ``objects``.

Where the cube goes once the table is away, the solver node finds (in its mode gripper).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ccr_msgs.msg import Object, ObjectArray
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node
from rclpy.parameter import Parameter
from shape_msgs.msg import SolidPrimitive
from std_msgs.msg import Header

from ccr_ros.nodes.conversions import pose_message
from ccr_ros.nodes.qos import LATCHED

from .cube_scene import CUBE, FRICTION, MASS

THERE, HELD = "there", "held"
_TELL_EVERY = 1.0  # s, when nothing changes


class CubeNode(Node):
    """A cube on a table that can be taken away.

    Args:
        options: Of `rclpy.node.Node`.

    Raises:
        rclpy.exceptions.ParameterException: A parameter is of the wrong type.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("demo_cube", **options)
        text = "Whether the cube is there at all; not yet, while cables are wound for their zeros."
        self.declare_parameter(THERE, False, ParameterDescriptor(description=text))
        text = "Whether the table is away, so that the fingers alone carry the cube."
        self.declare_parameter(HELD, False, ParameterDescriptor(description=text))
        self._objects = self.create_publisher(ObjectArray, "objects", LATCHED)
        self.add_post_set_parameters_callback(self._changed)
        self.create_timer(_TELL_EVERY, self._tell)
        self._tell()

    def _changed(self, _: Sequence[Parameter]) -> None:
        self._tell()

    def _tell(self) -> None:
        stamp = self.get_clock().now().to_msg()
        cube = Object(
            name=CUBE.name,
            primitive=SolidPrimitive(type=SolidPrimitive.BOX, dimensions=list(CUBE.dimensions)),
            pose=pose_message(CUBE.pose.position, CUBE.pose.orientation),
            mass=MASS,
            friction=FRICTION,
            held=bool(self.get_parameter(HELD).value),
        )
        objects = [cube] if self.get_parameter(THERE).value else []
        self._objects.publish(ObjectArray(header=Header(stamp=stamp), objects=objects))
