# SPDX-License-Identifier: Apache-2.0
"""Takes samples while exceptions of a signal handler come at all moments of it."""

import signal
import time

import embedded_ros

embedded_ros.enable()

import rclpy  # noqa: E402
from std_msgs.msg import Float64  # noqa: E402

from embedded_ros.interrupts import deliver  # noqa: E402


class Interrupted(Exception):
    """What the handler raises."""


def raise_interrupted():
    """Raise."""
    raise Interrupted


def main():
    """Count the interrupts that were met; a crash would end all."""
    rclpy.init()
    node = rclpy.create_node("interrupted")
    subscription = node.create_subscription(Float64, "busy", lambda _: None, 250)
    publisher = node.create_publisher(Float64, "busy", 250)
    while not publisher.get_subscription_count():
        time.sleep(0.01)
    signal.signal(signal.SIGALRM, lambda *_: deliver(raise_interrupted))
    met = 0
    for turn in range(150):
        for _ in range(200):
            publisher.publish(Float64(data=1.0))
        try:
            signal.setitimer(signal.ITIMER_REAL, 2e-5 * (1 + turn % 50))
            subscription.drain()
            time.sleep(0.003)
        except Interrupted:
            met += 1
    signal.setitimer(signal.ITIMER_REAL, 0)
    rclpy.shutdown()
    print(f"met: {met}", flush=True)


if __name__ == "__main__":
    main()
