# SPDX-License-Identifier: Apache-2.0
"""Waits for what never comes, in the way that the first argument names; a signal ends it."""

import contextlib
import threading

import embedded_ros

embedded_ros.enable()

import rclpy  # noqa: E402
from rclpy.duration import Duration  # noqa: E402
from rclpy.exceptions import ROSInterruptException  # noqa: E402
from rclpy.executors import ExternalShutdownException  # noqa: E402
from rclpy.utilities import remove_ros_args  # noqa: E402
from rclpy.wait_for_message import wait_for_message  # noqa: E402
from std_msgs.msg import String  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402


def spin(node):
    """Spin in a thread of its own."""
    with contextlib.suppress(ExternalShutdownException):
        rclpy.spin(node)


def wait(how, node):
    """Wait forever."""
    if how == "future":
        rclpy.spin_until_future_complete(node, rclpy.Future())
    elif how == "message":
        wait_for_message(String, node, "nothing")
    elif how == "sleep":
        node.get_clock().sleep_for(Duration(seconds=1000))
    elif how == "service":
        node.create_client(Trigger, "nowhere").wait_for_service()
    else:
        threading.Thread(target=spin, args=(node,), daemon=True).start()
        if how == "rate":
            node.create_rate(0.001).sleep()
        else:
            node.create_client(Trigger, "nowhere").call(Trigger.Request())


def main():
    """Wait until a signal comes."""
    rclpy.init()
    node = rclpy.create_node("waiting")
    node.create_timer(0.1, lambda: None)
    try:
        print("ready", flush=True)
        wait(remove_ros_args()[1], node)
    except (KeyboardInterrupt, ExternalShutdownException, ROSInterruptException):
        pass
    except Exception:
        # The signal came before the waiting had begun.
        if rclpy.ok():
            raise
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
