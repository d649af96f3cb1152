# SPDX-License-Identifier: Apache-2.0
"""Gives every test process its own ROS graph, and rclpy, before any test module is imported."""

import os
import signal
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import settings

from ccr_ros.blas import use_one_thread
from ccr_ros.runtime import enable_ros
from ccr_ros.stack.environment import free_domain

# The same examples on every machine, however slow it is.
settings.register_profile("ccr", derandomize=True, deadline=None, max_examples=25)
settings.load_profile("ccr")

use_one_thread()
os.environ["ROS_DOMAIN_ID"] = str(free_domain())
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
os.environ["ROS_PYTHON_CHECK_FIELDS"] = "1"  # real rclpy checks no field types by default
enable_ros()


@pytest.fixture(scope="session", autouse=True)
def interrupts():
    """Have SIGINT reach the programs under test, also where a script runs pytest in the background.

    A shell without job control has its background jobs ignore SIGINT, and their children with them.
    """
    before = signal.getsignal(signal.SIGINT)
    if before == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def pytest_addoption(parser):
    """Offer what takes too long for every run."""
    parser.addoption("--soak", action="store_true", help="run the tests that take ten minutes")


def pytest_collection_modifyitems(config, items):
    """Leave out what takes ten minutes, and what the transport in use cannot do.

    Files that have much to do come first: at the end, workers would wait for the last of them.
    """
    import rclpy

    weights: Counter[Path] = Counter()
    for item in items:
        for marker, weight in (("long", 3), ("processes", 1)):
            weights[item.path] += weight * (item.get_closest_marker(marker) is not None)
    items.sort(key=lambda item: -weights[item.path])

    rmw = rclpy.get_rmw_implementation_identifier()
    for item in items:
        if "fastrtps" in rmw and (marker := item.get_closest_marker("not_fast_dds")):
            item.add_marker(pytest.mark.skip(reason=f"Fast DDS: {marker.args[0]}"))
        if item.get_closest_marker("soak") and not config.getoption("--soak"):
            item.add_marker(pytest.mark.skip(reason="takes ten minutes; --soak runs it"))
    if rmw == "embedded_local":
        skip = pytest.mark.skip(reason="nodes of other processes are not reached")
        for item in items:
            if item.get_closest_marker("processes"):
                item.add_marker(skip)
