# SPDX-License-Identifier: Apache-2.0
"""Serves ``flip`` (std_srvs/SetBool): the answer is the opposite, the message counts the calls."""

import embedded_ros

embedded_ros.enable()

import rclpy  # noqa: E402
from rclpy.executors import ExternalShutdownException  # noqa: E402
from std_srvs.srv import SetBool  # noqa: E402


def main():
    """Serve until a signal comes."""
    rclpy.init()
    node = rclpy.create_node("flipper")
    calls = []

    def flip(request, response):
        calls.append(request.data)
        response.success = not request.data
        response.message = str(len(calls))
        return response

    node.create_service(SetBool, "flip", flip)
    print("ready", flush=True)
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
