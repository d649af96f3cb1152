# SPDX-License-Identifier: Apache-2.0
"""Publishes a count on ``chatter`` and once on the latched topic ``map``; ends with exit code 0."""

import embedded_ros

embedded_ros.enable()

import rclpy  # noqa: E402
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor  # noqa: E402
from rclpy.node import Node  # noqa: E402
from rclpy.qos import DurabilityPolicy, QoSProfile  # noqa: E402
from rclpy.utilities import remove_ros_args  # noqa: E402
from std_msgs.msg import String  # noqa: E402


class Talker(Node):
    """A publisher with a timer."""

    def __init__(self):
        super().__init__("talker")
        self.count = 0
        self.publisher = self.create_publisher(String, "chatter", 10)
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.map = self.create_publisher(String, "map", latched)
        self.map.publish(String(data="the map"))
        self.timer = self.create_timer(0.05, self.tick)

    def tick(self):
        """Publish the next number."""
        self.count += 1
        self.publisher.publish(String(data=str(self.count)))
        if self.count == 1:
            print("ready", flush=True)


def main():
    """Spin until a signal comes."""
    rclpy.init()
    node = Talker()
    executor = MultiThreadedExecutor(2) if "multi" in remove_ros_args() else None
    how = "returned"
    try:
        rclpy.spin(node, executor)
    except (KeyboardInterrupt, ExternalShutdownException) as end:
        how = type(end).__name__
    except Exception:
        if rclpy.ok():
            raise
        how = "cut short"  # as real rclpy may be, when the signal comes between two turns
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    print(f"ended: {how}", flush=True)


if __name__ == "__main__":
    main()
