# SPDX-License-Identifier: Apache-2.0
"""What the tests of the servo bridge do again and again: command, wait, ask."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

from ccr_msgs.msg import CablePulls, ServoJoint, ServoState
from ccr_msgs.srv import Calibrate
from probe import TIMEOUT, Probe
from std_msgs.msg import Header
from std_srvs.srv import Trigger

_REPEAT = 0.05  # s between commands that shall go on counting


class ServoProbe:
    """Talks to a servo bridge in the probe's namespace."""

    def __init__(self, probe: Probe) -> None:
        self.probe = probe
        self.states: list[ServoState] = probe.listen(ServoState, "servo_state")
        self._clients: dict[str, Any] = {}

    @property
    def state(self) -> ServoState:
        """The newest state; waits for the first."""
        return self.probe.until(lambda: self.states and self.states[-1], "a servo state")

    def joint(self, name: str) -> ServoJoint:
        return next(joint for joint in self.state.joints if joint.name == name)

    def in_state(self, state: int) -> ServoState:
        """Wait for a state of the bridge."""
        return self.probe.until(
            lambda: self.states and self.states[-1].state == state and self.states[-1],
            f"state {state}",
        )

    def command(self, finger: str, pulls: list[float], names: tuple[str, ...] = (), at=None):
        message = CablePulls(names=list(names), pulls=[float(pull) for pull in pulls])
        if at is not None:
            message.header = Header(stamp=at)
        self.probe.publish(f"{finger}/cable_pull_commands", message)

    def lead(self, condition: Callable[[], Any], **pulls: list[float]) -> Any:
        """Command fingers again and again until the condition is true; return its value."""
        deadline, last = time.monotonic() + TIMEOUT, -math.inf
        while not (value := condition()):
            now = time.monotonic()
            assert now < deadline, "what was waited for did not come"
            if now - last >= _REPEAT:
                last = now
                for finger, wanted in pulls.items():
                    self.command(finger, wanted)
            self.probe.executor.spin_once(timeout_sec=0.02)
        return value

    def lead_to(self, finger: str, pull: float) -> None:
        """Command the one cable `main` of a finger until it is there."""
        name = f"{finger}_main"
        self.lead(lambda: abs(self.joint(name).pull - pull) < 1e-4, **{finger: [pull]})

    def call(self, kind: type, service: str, request: Any = None) -> Any:
        """Call a service and return its answer."""
        if service not in self._clients:
            self._clients[service] = self.probe.node.create_client(kind, service)
            assert self._clients[service].wait_for_service(TIMEOUT)
        future = self._clients[service].call_async(request or kind.Request())
        return self.probe.until(future.done, f"an answer of {service}") and future.result()

    def trigger(self, verb: str) -> Trigger.Response:
        return self.call(Trigger, f"servo_bridge_node/{verb}")

    def calibrate(self, *joints: str) -> Calibrate.Response:
        request = Calibrate.Request(joints=list(joints))
        return self.call(Calibrate, "servo_bridge_node/calibrate", request)

    def pulls(self, finger: str) -> list[CablePulls]:
        return self.probe.listen(CablePulls, f"{finger}/cable_pulls", latched=False)

    def still(self, finger: str, seconds: float = 0.4) -> float:
        """Spin for a while; return how far the finger's first cable moved."""
        heard = self.pulls(finger)
        heard.clear()
        self.probe.until(lambda: heard, "measured pulls")
        first, count = heard[-1].pulls[0], len(heard)
        self.probe.spin_for(seconds)
        self.probe.until(lambda: len(heard) > count, "measured pulls")
        return max(abs(message.pulls[0] - first) for message in heard[count:])
