# SPDX-License-Identifier: Apache-2.0
"""Traffic for ``endurance.py ROLE SECONDS RATE``, with entities that come and go all the time.

``ask`` publishes poses at RATE and calls a service at a tenth of it, ``answer`` sends them back and
serves; both make a node and everything in it every second and destroy it again. Both print a line
``ROLE seconds messages kilobytes threads files`` ten times, which is what must not grow.
"""

import threading
import time
from pathlib import Path

import embedded_ros

embedded_ros.enable()

import rclpy  # noqa: E402
from geometry_msgs.msg import Pose, PoseArray  # noqa: E402
from rclpy.callback_groups import ReentrantCallbackGroup  # noqa: E402
from rclpy.executors import MultiThreadedExecutor  # noqa: E402
from rclpy.utilities import remove_ros_args  # noqa: E402
from std_msgs.msg import String  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402

REPORTS = 10


def resources():
    """Resident memory [kB], threads and open files of this process."""
    lines = Path("/proc/self/status").read_text().splitlines()
    resident = next(line.split()[1] for line in lines if line.startswith("VmRSS:"))
    tasks, files = Path("/proc/self/task"), Path("/proc/self/fd")
    return resident, len(list(tasks.iterdir())), len(list(files.iterdir()))


class Endurance:
    """One end of the traffic."""

    def __init__(self, role, seconds, rate):
        self.role, self.seconds = role, seconds
        self.node = rclpy.create_node(role)
        self.count = 0
        there, back = ("back", "there") if role == "ask" else ("there", "back")
        self.publisher = self.node.create_publisher(PoseArray, back, 100)
        self.node.create_subscription(PoseArray, there, self.receive, 100)
        group = ReentrantCallbackGroup()
        if role == "ask":
            self.client = self.node.create_client(Trigger, "serve", callback_group=group)
            self.node.create_timer(1.0 / rate, self.send)
            self.node.create_timer(10.0 / rate, self.call, group)
        else:
            self.node.create_service(Trigger, "serve", lambda _, reply: reply)
        self.node.create_timer(1.0, self.churn)
        self.begin = time.monotonic()
        self.reports = 0
        self.ended = rclpy.task.Future()
        self.node.create_timer(seconds / REPORTS, self.report)

    def send(self):
        """Publish."""
        self.publisher.publish(PoseArray(poses=[Pose() for _ in range(10)]))

    def receive(self, message):
        """Count, and send back what was asked."""
        self.count += 1
        if self.role == "answer":
            self.publisher.publish(message)

    def call(self):
        """Ask and forget, which a client must bear, until the server is there."""
        if self.client.service_is_ready():
            self.client.call_async(Trigger.Request())

    def churn(self):
        """Make a node with everything in it, and destroy it."""
        node = rclpy.create_node(f"{self.role}_guest")
        publisher = node.create_publisher(String, "guests", 10)
        node.create_subscription(String, "guests", lambda _: None, 10)
        node.create_service(Trigger, "~/serve", lambda _, reply: reply)
        client = node.create_client(Trigger, "~/serve")
        node.create_timer(0.1, lambda: None)
        node.create_guard_condition(lambda: None)
        publisher.publish(String(data="here"))
        node.destroy_client(client)
        node.destroy_node()

    def report(self):
        """Print what is in use."""
        self.reports += 1
        passed = time.monotonic() - self.begin
        print(self.role, round(passed), self.count, *resources(), flush=True)
        if self.reports == REPORTS:
            self.ended.set_result(None)


def main():
    """Run for so long."""
    role, seconds, rate = remove_ros_args()[1:4]
    rclpy.init()
    endurance = Endurance(role, float(seconds), float(rate))
    executor = MultiThreadedExecutor(2)
    executor.add_node(endurance.node)
    executor.spin_until_future_complete(endurance.ended)
    executor.shutdown()
    endurance.node.destroy_node()
    rclpy.shutdown()
    threading.Event().wait(0.1)


if __name__ == "__main__":
    main()
