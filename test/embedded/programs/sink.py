# SPDX-License-Identifier: Apache-2.0
"""Takes everything on ``heap``."""

import contextlib

import embedded_ros

embedded_ros.enable()

import rclpy  # noqa: E402
from rclpy.executors import ExternalShutdownException  # noqa: E402
from rclpy.qos import HistoryPolicy, QoSProfile  # noqa: E402
from std_msgs.msg import UInt8MultiArray  # noqa: E402


def main():
    """Spin."""
    rclpy.init()
    node = rclpy.create_node("sink")
    everything = QoSProfile(history=HistoryPolicy.KEEP_ALL, depth=1)
    node.create_subscription(UInt8MultiArray, "heap", lambda _: None, everything)
    print("ready", flush=True)
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(node)


if __name__ == "__main__":
    main()
