# SPDX-License-Identifier: Apache-2.0
"""How long messages take from process to process, and what they cost.

The baseline, "bytes", is the middleware itself: the PyPI package cyclonedds with messages of the
same size that were encoded beforehand. What is above it is spent on messages, executor and nodes.
"cyclonedds" is what the same package needs with message classes of its own. "rclpy" is the one that
is installed: this project's, or in a shell with ROS 2 the real one.
"""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ccr_ros.runtime import real_ros
from ccr_ros.stack.environment import DOMAINS, is_free
from embedded_ros.transport.cyclone_config import domain_xml

from .measure import Row

GROUP, BASELINE = "transport", "bytes"
CARRIERS = ("rclpy", "bytes", "cyclonedds")
SIZES = {"Float64": 1, "PoseArray": 10, "MarkerArray": 60, "round trip": 1, "idle": 1}
ROLES = {"round trip": ("call", "serve"), "idle": ("idle",)}
LIMIT = 120  # s, after which a peer is taken to hang


@dataclass(frozen=True)
class Connection:
    """What one row will measure."""

    case: str
    carrier: str

    def row(self) -> Row:
        """The row, to be filled."""
        n = SIZES[self.case]
        row_id = f"{GROUP}/{self.case}/n{n}/{self.carrier}"
        return Row(GROUP, self.carrier, self.case, n, False, BASELINE, row_id)


def connections(quick: bool) -> list[Connection]:
    """What can be measured here."""
    cases = ("Float64", "round trip") if quick else tuple(SIZES)
    here = importlib.util.find_spec("cyclonedds") is not None
    carriers = CARRIERS if here else ("rclpy",)
    return [
        Connection(case, carrier)
        for case in cases
        for carrier in carriers
        if carrier != "cyclonedds" or case not in ROLES
    ]


def measure_connection(row: Row, quick: bool) -> None:
    """Fill a row; several short runs, so that a disturbance hits a part only."""
    ages: list[float] = []
    costs: list[float] = []
    for _ in range(1 if quick else 3):
        run_ages, cost = _run(row.name, row.case, _count(row.case, quick))
        ages += run_ages
        costs.append(cost)
    row.cpu_ms = float(np.median(costs))
    row.samples = row.converged = len(ages)
    if ages:
        row.p50_ms, row.p99_ms = (float(v) for v in np.percentile(ages, [50, 99]))
    if row.name == "rclpy":
        row.note = "ROS 2's" if real_ros() else "embedded"


def _count(case: str, quick: bool) -> int:
    if case == "idle":
        return 5  # s
    return 100 if quick or case == "MarkerArray" else 400


def _run(carrier: str, case: str, count: int) -> tuple[list[float], float]:
    """Times [ms] of the messages, and CPU time [ms] of both ends for one of them."""
    domain = str(next(domain for domain in DOMAINS if is_free(domain)))
    settings = {"ROS_DOMAIN_ID": domain, "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    if carrier != "rclpy":
        settings["CYCLONEDDS_URI"] = domain_xml(settings)
    command = [sys.executable, "-m", "benchmarks.transport_peer", carrier, case]
    roles = ROLES.get(case, ("send", "receive"))
    ends: list[subprocess.Popen[str]] = []
    try:
        for role in reversed(roles):  # who answers comes first
            end = subprocess.Popen(
                [*command, role, str(count)],
                stdout=subprocess.PIPE,
                text=True,
                cwd=Path(__file__).parents[1],
                env={**os.environ, **settings},
            )
            ends.append(end)
            if role in ("receive", "serve") and end.stdout is not None:
                end.stdout.readline()
        told = [json.loads(end.communicate(timeout=LIMIT)[0].splitlines()[-1]) for end in ends]
    finally:
        for end in ends:
            end.kill()
    return [age for each in told for age in each["ages_ms"]], sum(each["cpu_ms"] for each in told)
