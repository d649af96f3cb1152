# SPDX-License-Identifier: Apache-2.0
"""Fixtures of the node tests: a context of their own, a probe, a solver node beside it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import rclpy
from cube_stack import CubeStack
from gripper_stack import GripperStack
from probe import Probe
from rclpy.context import Context
from rclpy.parameter import Parameter
from servo_probe import ServoProbe

from ccr_ros.nodes.gripper_coordinator_node import GripperCoordinatorNode
from ccr_ros.nodes.servo_bridge_node import ServoBridgeNode
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
def start_coordinator(context: Context, probe: Probe) -> Callable[..., GripperCoordinatorNode]:
    """Return a function that starts a coordinator beside the probe; ``__`` in names is a dot."""

    def start(namespace: str = "gripper", **values: Any) -> GripperCoordinatorNode:
        overrides = [Parameter(n.replace("__", "."), value=v) for n, v in values.items()]
        options = {"context": context, "namespace": namespace}
        return probe.add(GripperCoordinatorNode(**options, parameter_overrides=overrides))

    return start


@pytest.fixture
def stack(context: Context, probe: Probe) -> Iterator[Callable[..., GripperStack]]:
    """Return a function that starts a gripper's nodes; values are the coordinator's parameters."""
    started = []

    def start(**values: Any) -> GripperStack:
        started.append(GripperStack(context, probe, **values))
        return started[-1]

    yield start
    for stack in started:
        stack.close()


@pytest.fixture
def cube(context: Context, probe: Probe) -> Iterator[Callable[..., CubeStack]]:
    """Return a function that starts the nodes of the cube's gripper."""
    started = []

    def start(**values: Any) -> CubeStack:
        started.append(CubeStack(context, probe, **values))
        return started[-1]

    yield start
    for stack in started:
        stack.close()


@pytest.fixture
def start_bridge(context: Context, probe: Probe, tmp_path: Path) -> Callable[..., ServoBridgeNode]:
    """Return a function that starts a servo bridge beside the probe; zeros go to a file of ours."""

    def start(namespace: str = "gripper", **values: Any) -> ServoBridgeNode:
        values = {"calibration_file": str(tmp_path / "zeros.yaml"), **values}
        overrides = [Parameter(n.replace("__", "."), value=v) for n, v in values.items()]
        options = {"context": context, "namespace": namespace}
        return probe.add(ServoBridgeNode(**options, parameter_overrides=overrides))

    return start


@pytest.fixture
def servos(probe: Probe) -> ServoProbe:
    return ServoProbe(probe)


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


@pytest.fixture
def small_rack(small_gripper: str, tmp_path: Path) -> dict[str, str]:
    """Parameters of a servo bridge for the small gripper: three cables, not in its order."""
    path = tmp_path / "small_servos.yaml"
    path.write_text(
        """
name: small_rack
defaults:
  {spool_radius: 0.008, travel: [-0.003, 0.01], max_rate: 0.02, max_acceleration: 0.1,
   max_tension: 30.0}
joints:
  - {finger: index, cable: main, direction: -1, id: 3}
  - {finger: thumb, cable: helical, gear: 2.0, id: 2}
  - {finger: thumb, cable: straight, id: 1}
""",
        encoding="utf-8",
    )
    return {"gripper_file": small_gripper, "servo_file": str(path)}
