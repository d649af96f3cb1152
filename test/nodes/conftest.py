# SPDX-License-Identifier: Apache-2.0
"""Fixtures of the node tests: a context of their own, a probe, a solver node beside it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import rclpy
from gripper_stack import GripperStack
from probe import Probe
from rclpy.context import Context
from rclpy.parameter import Parameter

from ccr_ros.nodes.solver_node import SolverNode
from ccr_ros.resources import config_dir


@pytest.fixture(scope="session")
def context() -> Iterator[Context]:
    context = Context()
    rclpy.init(args=[], context=context)
    yield context
    context.try_shutdown()


@pytest.fixture
def probe(context: Context) -> Iterator[Probe]:
    probe = Probe(context)
    yield probe
    probe.close()


@pytest.fixture
def start(context: Context, probe: Probe) -> Callable[..., SolverNode]:
    """Return a function that starts a solver node beside the probe, with parameters by name."""

    def start(namespace: str = "gripper", **values: Any) -> SolverNode:
        overrides = [Parameter(name, value=value) for name, value in values.items()]
        node = SolverNode(context=context, namespace=namespace, parameter_overrides=overrides)
        return probe.add(node)

    return start


@pytest.fixture
def stack(context: Context, probe: Probe) -> Iterator[Callable[..., GripperStack]]:
    """Return a function that starts a gripper's nodes; values are the coordinator's parameters."""
    started = []

    def start(at: float = 0.0, **values: Any) -> GripperStack:
        started.append(GripperStack(context, probe, at, **values))
        return started[-1]

    yield start
    for stack in started:
        stack.close()


@pytest.fixture
def small_gripper(tmp_path: Path) -> str:
    """A gripper of two unlike fingers: ``thumb`` with two cables, ``index`` with one."""
    path = tmp_path / "small_gripper.yaml"
    path.write_text(
        f"""
name: small
fingers:
  - name: thumb
    base: {{position: [0.05, 0.0, 0.01], orientation: [0.0, 0.0, 1.0, 0.0]}}
    file: {config_dir() / "two_cables.yaml"}
  - name: index
    base: {{position: [-0.05, 0.0, 0.0]}}
    file: {config_dir() / "straight.yaml"}
""",
        encoding="utf-8",
    )
    return str(path)
