# SPDX-License-Identifier: Apache-2.0
"""Listens on ``chatter`` for so many seconds at most; prints whether it heard anything."""

import time

import embedded_ros

embedded_ros.enable()

import rclpy  # noqa: E402
from rclpy.utilities import remove_ros_args  # noqa: E402
from std_msgs.msg import String  # noqa: E402


def main():
    """Listen."""
    rclpy.init()
    node = rclpy.create_node("listener")
    got = []
    node.create_subscription(String, "chatter", got.append, 10)
    end = time.monotonic() + float(remove_ros_args()[1])
    # A message may come before the name of the node that sent it.
    while not (got and "talker" in node.get_node_names()) and time.monotonic() < end:
        rclpy.spin_once(node, timeout_sec=0.05)
    print("heard" if got else "silence", *node.get_node_names(), flush=True)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main()
