# SPDX-License-Identifier: Apache-2.0
"""The demo's gripper, designed for its ball and written as files."""

from __future__ import annotations

import time
from pathlib import Path

from ccr_ros.design.curve_text import object_from_text
from ccr_ros.design.gripper import GripperTask, design_gripper
from ccr_ros.design.gripper_files import write_gripper
from ccr_ros.design.gripper_layout import GripperLayout
from ccr_ros.design.gripper_report import kinds_of, summary
from ccr_ros.design.pull import Pull
from ccr_ros.model import load_finger
from ccr_ros.resources import find_config

from .scene import DIAMETER, HEIGHT

# The paper's section 4.1.
BASE_RADIUS = 0.042  # m
FINGERS = 3
PULL = 0.03  # of the cable's length at rest
NAME = "gripper_sphere"
FILES = (f"{NAME}.yaml", "sphere_finger.yaml")


def design_for_ball(folder: Path) -> tuple[Path, str]:
    """Design fingers that a pull of 3 % lays on the ball; write the gripper's files.

    Args:
        folder: Where they go.

    Returns:
        The gripper file, and what the design amounts to in a line.

    Raises:
        InvalidFile: A file cannot be written.
    """
    begin = time.monotonic()
    ball = object_from_text(f"sphere:{DIAMETER}")
    template = load_finger(find_config("sphere_finger"))  # of which the rest shape does not matter
    layout = GripperLayout(ball, HEIGHT, BASE_RADIUS, FINGERS)
    pulls = {template.cable_names[0]: Pull(PULL, relative=True)}
    design = design_gripper(GripperTask(layout, template, pulls), NAME)
    kinds = kinds_of(design)
    text = summary(design.fingers[0])
    paths = write_gripper(
        design.gripper, kinds, folder, "sphere_finger", "Made by: ccr demo", [text]
    )
    return paths[0], f"designed {paths[0]} in {time.monotonic() - begin:.2f} s. {text}"
