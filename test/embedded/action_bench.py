# SPDX-License-Identifier: Apache-2.0
"""An action server and a client, for tests."""

from example_interfaces.action import Fibonacci
from rclpy.action import ActionClient, ActionServer

Goal, Result = Fibonacci.Goal, Fibonacci.Result


class Bench:
    """A server that keeps the handles of its goals, and a client."""

    def __init__(self, make_node, executor, spin, finish):
        self.server_node, self.client_node = make_node("server"), make_node("client")
        executor.add_node(self.server_node)
        executor.add_node(self.client_node)
        self.executor, self.spin_until, self.finish = executor, spin, finish
        self.handles, self.ends = [], []

    def start(self, execute=None, **kwargs):
        """Serve; by default goals succeed with their order as result."""
        self.server = ActionServer(
            self.server_node, Fibonacci, "count", execute or self.succeed, **kwargs
        )
        self.ends.append(self.server)
        self.client = self.connect()

    def connect(self):
        """Another client."""
        client = ActionClient(self.client_node, Fibonacci, "count")
        self.ends.append(client)
        assert client.wait_for_server(60)
        return client

    def close(self):
        """Destroy what was made here: a node does not do that for its actions."""
        for end in self.ends:
            end.destroy()

    def defer(self, **kwargs):
        """Serve; goals are accepted, and executed when somebody does it."""
        self.start(handle_accepted_callback=self.handles.append, **kwargs)

    def succeed(self, handle):
        if handle not in self.handles:
            self.handles.append(handle)
        handle.succeed()
        return Result(sequence=[handle.request.order])

    def spin(self, condition):
        assert self.spin_until(condition, executor=self.executor)

    def send(self, order=0, **kwargs):
        """Send a goal; the client's handle."""
        return self.finish(self.client.send_goal_async(Goal(order=order), **kwargs))

    def result(self, handle):
        return self.finish(handle.get_result_async())
