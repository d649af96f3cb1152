# SPDX-License-Identifier: Apache-2.0
"""The coordinator's parameters: those of `GraspSettings`, and how far each finger may be pulled."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node
from rclpy.parameter import Parameter

from ccr_ros.grasp.finger_control import FingerControl
from ccr_ros.grasp.free_motion import free_motion
from ccr_ros.grasp.pull_path import CLOSED_FRACTION, PullPath, pull_path
from ccr_ros.grasp.settings import GraspSettings
from ccr_ros.model import Finger, Gripper, InvalidValue, load_gripper
from ccr_ros.resources import find_config

from .declarations import Declarations


@dataclass(frozen=True)
class GripperParameters:
    """What is fixed when the coordinator starts.

    Attributes:
        gripper: From the gripper file.
        settings: Speeds, forces and times.
        paths: Of the fingers' pulls, in the gripper's order.
        ranges: Lowest and highest pull (m, 2) [m] of each finger while an object is moved.
        shares: Times the target force that each finger presses with.
        control_rate: Steps per second [Hz].
        state_rate: GripperState and feedback messages per second [Hz].
    """

    gripper: Gripper
    settings: GraspSettings
    paths: tuple[PullPath, ...]
    ranges: tuple[np.ndarray, ...]
    shares: tuple[float, ...]
    control_rate: float
    state_rate: float

    def controls(self) -> list[FingerControl]:
        """Return the fingers, each with its free motion solved.

        Raises:
            CcrError: A finger has no Young's modulus, or no pose at some of the pulls.
        """
        return [
            FingerControl(
                mounted.finger.name,
                mounted.finger.cable_names,
                path,
                free_motion(mounted, path),
                pulls,
                share,
            )
            for mounted, path, pulls, share in zip(
                self.gripper.fingers, self.paths, self.ranges, self.shares, strict=True
            )
        ]


def declare(node: Node) -> GripperParameters:
    """Declare all parameters of the coordinator and return them.

    Raises:
        CcrError: The gripper file is not found or not valid, or a setting is not.
        rclpy.exceptions.ParameterException: A value is of the wrong type or out of its range.
    """
    parameters = Declarations(node)
    file = parameters.fixed(
        "gripper_file",
        "gripper_sphere",
        "Gripper file: a path, or the name of a file that comes with ccr_ros.",
    )
    control_rate = parameters.fixed(
        "control_rate", 50.0, "Steps and commands per second [Hz].", (5.0, 500.0)
    )
    state_rate = parameters.fixed(
        "state_rate",
        10.0,
        "GripperState and feedback messages per second [Hz]; changes are told at once.",
        (0.5, 100.0),
    )
    values = {}
    for item in fields(GraspSettings):
        limits = item.metadata
        values[item.name] = parameters.fixed(
            item.name,
            item.default,
            f"{limits['text']} [{limits['unit']}]",
            (limits["low"], limits["high"]),
        )
    gripper = load_gripper(find_config(file))
    paths = tuple(_path(node, mounted.finger) for mounted in gripper.fingers)
    ranges = tuple(
        _range(node, mounted.finger, path)
        for mounted, path in zip(gripper.fingers, paths, strict=True)
    )
    shares = tuple(
        parameters.fixed(
            f"{name}.force_share",
            1.0,
            "Times the target force that this finger presses with: 2 for a thumb against two.",
            (0.01, 100.0),
        )
        for name in gripper.finger_names
    )
    settings = GraspSettings(**values)
    return GripperParameters(gripper, settings, paths, ranges, shares, control_rate, state_rate)


def _path(node: Node, finger: Finger) -> PullPath:
    count = len(finger.cables)
    closed = [CLOSED_FRACTION * finger.length] if count == 1 else None
    return pull_path(
        finger,
        _pulls(node, finger, "open", [0.0] * count, "open; nothing is touched there"),
        _pulls(node, finger, "closed", closed, "as far closed as it may ever go"),
    )


def _range(node: Node, finger: Finger, path: PullPath) -> np.ndarray:
    """Return the pulls (m, 2) [m] that a motion of the object may use."""
    low, high = np.minimum(path.open, path.closed), np.maximum(path.open, path.closed)
    columns = []
    for key, default, what in (("least", low, "let out"), ("largest", high, "pulled")):
        text = f"as far {what} as a motion of the object may want"
        values = _pulls(node, finger, key, default.tolist(), text)
        try:
            columns.append(finger.pulls_array(values or []))
        except InvalidValue as error:
            inner = error.place.removeprefix("pulls")
            place = f"{finger.name}.{key}_pulls{inner}"
            raise InvalidValue(place, error.value, error.allowed) from None
    if (columns[0] > columns[1]).any():
        allowed = f"no more than largest_pulls, {columns[1].tolist()}"
        raise InvalidValue(f"{finger.name}.least_pulls", columns[0].tolist(), allowed)
    return np.column_stack(columns)


def _pulls(node: Node, finger: Finger, key: str, default: Any, what: str) -> list[float] | None:
    name = f"{finger.name}.{key}_pulls"
    descriptor = ParameterDescriptor(
        description=f"Pulls [m] of the finger's cables at which it is {what}. "
        "Takes effect at start only.",
        additional_constraints="one per cable",
        read_only=True,
    )
    # Of several cables nobody knows which close the finger: without a value the error says so.
    kind = Parameter.Type.DOUBLE_ARRAY
    value = node.declare_parameter(name, kind if default is None else default, descriptor).value
    return None if value is None else list(value)
