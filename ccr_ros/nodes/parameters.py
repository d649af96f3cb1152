# SPDX-License-Identifier: Apache-2.0
"""The solver node's parameters: declared with description and range, then read as one value."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from rclpy.node import Node

from ccr_ros.grasp.statics import DiskShape
from ccr_ros.grasp.statics.body import GRAVITY
from ccr_ros.model import (
    Gripper,
    InvalidValue,
    SolverSettings,
    UnknownName,
    checks,
    load_gripper,
)
from ccr_ros.resources import find_config

from .declarations import Declarations
from .frames import prefix_of

MARKERS = "markers"
MARKER_RATE = "marker_rate"
FINGERS, GRIPPER = "fingers", "gripper"
MODES = (FINGERS, GRIPPER)


@dataclass(frozen=True)
class SolverParameters:
    """What is fixed when the solver node starts.

    Attributes:
        gripper: From the gripper file.
        settings: How its fingers are solved.
        frame_prefix: Before every frame name but the gripper's own.
        gripper_frame: The gripper's frame.
        mode: ``fingers``, each by itself, or ``gripper``: all and the object together.
        object_name: Of the object in mode gripper; empty: the one with a mass, or held.
        gravity: (3,) [m/s^2] in the gripper's frame.
        grasp_state_rate: Most messages per second [Hz].
        quality_rate: Most measurements of the grasp's quality per second [Hz].
        disks: What of them presses on other fingers' disks in mode gripper; None: nothing.
        move_margin: Least friction margin of a planned motion, if the request says none.
        move_time_limit: Longest that planning a motion may take [s].
    """

    gripper: Gripper
    settings: SolverSettings
    frame_prefix: str
    gripper_frame: str
    mode: str
    object_name: str
    gravity: np.ndarray
    grasp_state_rate: float
    quality_rate: float
    disks: DiskShape | None
    move_margin: float
    move_time_limit: float


def declare(node: Node) -> SolverParameters:
    """Declare all parameters of the solver node and return the fixed ones.

    Raises:
        CcrError: The gripper file is not found or not valid, or a setting is not.
        rclpy.exceptions.ParameterException: A value is of the wrong type or out of its range.
    """

    parameters = Declarations(node)
    gripper_file = parameters.fixed(
        "gripper_file",
        "gripper_sphere",
        "Gripper file: a path, or the name of a file that comes with ccr_ros.",
    )
    arcs = parameters.fixed(
        "arcs_per_segment",
        SolverSettings.arcs_per_segment,
        "Number of arcs that a segment between two disks is modelled by; more are finer, slower.",
        (1, 64),
    )
    cable_model = parameters.fixed(
        "cable_model",
        SolverSettings.cable_model,
        "frictionless: a cable's total length is given, its tension is uniform; "
        "proportional: every span is shortened alike.",
        "frictionless or proportional",
    )
    time_limit = parameters.fixed(
        "time_limit",
        1.0,
        "Longest CPU time of one search [s]; a solve is one, or two where obstacles bar the way; "
        "one that takes longer ends without a new pose.",
        (0.001, 60.0),
    )
    prefix = parameters.fixed(
        "frame_prefix",
        prefix_of(node.get_namespace()),
        "Put before the fingers' frame names; its default comes from the node's namespace.",
        "no '/' at the start",
    )
    gripper_frame = parameters.fixed(
        "gripper_frame",
        f"{prefix}gripper_base",
        "Frame the fingers stand in and objects are given in; its default has the frame_prefix.",
        "not empty, no '/' at the start",
    )
    mode = parameters.fixed(
        "mode",
        FINGERS,
        "fingers: each finger by itself, objects stand still; gripper: all fingers and the object"
        " in one equilibrium, in which they may carry it.",
        "fingers or gripper",
    )
    object_name = parameters.fixed(
        "object",
        "",
        "Name of the object in mode gripper, among those on the topic objects; empty: the only one"
        " that has a mass or is held.",
    )
    gravity = parameters.fixed(
        "gravity",
        GRAVITY.tolist(),
        "Gravity in the gripper's frame [m/s^2], in mode gripper; the default is for a gripper"
        " that points up.",
        "3 numbers",
    )
    grasp_state_rate = parameters.fixed(
        "grasp_state_rate",
        10.0,
        "Most GraspState messages per second [Hz], in mode gripper; none are sent while nothing"
        " comes in.",
        (0.5, 100.0),
    )
    quality_rate = parameters.fixed(
        "quality_rate",
        2.0,
        "How often a second the grasp's quality is measured at most [Hz], in mode gripper; it takes"
        " some 30 ms, and pulls wait meanwhile.",
        (0.05, 100.0),
    )
    disk_contact = parameters.fixed(
        "disk_contact",
        False,
        "Whether disks of different fingers press on each other, in mode gripper, instead of going"
        " through each other.",
    )
    disk_rim = parameters.fixed(
        "disk_rim",
        0.0,
        "How far disks reach beyond their holes [m], for disk_contact.",
        (0.0, 1.0),
    )
    move_margin = parameters.fixed(
        "move_margin",
        0.1,
        "Least friction margin of every contact in a motion that ~/plan_move plans, where the"
        " request says none.",
        (0.0, 0.99),
    )
    move_time_limit = parameters.fixed(
        "move_time_limit",
        60.0,
        "Longest that ~/plan_move may plan [s]; it then answers with what it has.",
        (0.1, 3600.0),
    )
    parameters.live(MARKERS, True, "Publish markers for RViz and the like.")
    parameters.live(
        MARKER_RATE,
        20.0,
        "Most marker messages per second [Hz]; none are sent while nothing moves.",
        (0.1, 100.0),
    )
    if mode not in MODES:
        raise UnknownName("mode", mode, MODES)
    return SolverParameters(
        gripper=load_gripper(find_config(gripper_file)),
        settings=SolverSettings(
            arcs_per_segment=arcs, cable_model=cable_model, time_limit=time_limit
        ),
        frame_prefix=_frame("frame_prefix", prefix, may_be_empty=True),
        gripper_frame=_frame("gripper_frame", gripper_frame, may_be_empty=False),
        mode=mode,
        object_name=object_name,
        gravity=checks.vector("gravity", list(gravity), 3, unit="m/s^2", largest=1e3),
        grasp_state_rate=grasp_state_rate,
        quality_rate=quality_rate,
        disks=DiskShape(rim=disk_rim) if disk_contact else None,
        move_margin=move_margin,
        move_time_limit=move_time_limit,
    )


def _frame(name: str, value: str, may_be_empty: bool) -> str:
    # tf2 refuses frames that start with '/'.
    if value.startswith("/") or value != value.strip() or not (value or may_be_empty):
        empty = "" if may_be_empty else "not empty, "
        raise InvalidValue(name, value, f"{empty}without '/' at the start and blanks around it")
    return value
