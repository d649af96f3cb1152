# SPDX-License-Identifier: Apache-2.0
"""Serves the action ``count``: feedback 1, 2, ... up to the order, which is the result. Goals of
order 0 never end.
"""

import embedded_ros

embedded_ros.enable()

import rclpy  # noqa: E402
from example_interfaces.action import Fibonacci  # noqa: E402
from rclpy.action import ActionServer, CancelResponse  # noqa: E402
from rclpy.callback_groups import ReentrantCallbackGroup  # noqa: E402
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor  # noqa: E402


def execute(handle):
    """Count, in a thread of the executor."""
    done, last, node = [], handle.request.order, node_of[0]
    rate = node.create_rate(50.0)
    while not last or len(done) < last:
        if handle.is_cancel_requested:
            handle.canceled()
            return Fibonacci.Result(sequence=done)
        done.append(len(done) + 1)
        handle.publish_feedback(Fibonacci.Feedback(sequence=done[-1:]))
        rate.sleep()
    handle.succeed()
    return Fibonacci.Result(sequence=done)


node_of = []


def main():
    """Spin until a signal comes."""
    rclpy.init()
    node = rclpy.create_node("counter")
    node_of.append(node)
    server = ActionServer(
        node,
        Fibonacci,
        "count",
        execute,
        callback_group=ReentrantCallbackGroup(),
        cancel_callback=lambda handle: CancelResponse.ACCEPT,
    )
    print("ready", flush=True)
    try:
        rclpy.spin(node, MultiThreadedExecutor(4))
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        server.destroy()
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
