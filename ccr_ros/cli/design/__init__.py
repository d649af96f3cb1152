# SPDX-License-Identifier: Apache-2.0
"""Find the finger, the pulls, or the gripper for what is wanted.

A finger is a finger file or the name of one in config/ (helical, sphere_finger, ...).
"""

from __future__ import annotations

#: One line for each command: its module, which is imported when it is asked for, and its help.
COMMANDS: dict[str, tuple[str, str]] = {
    "rest-shape": ("ccr_ros.cli.design.rest_shape", "the rest shape that pulls bend into a shape"),
    "routing": ("ccr_ros.cli.design.routing", "the holes whose cable bends a finger into a shape"),
    "pulls": ("ccr_ros.cli.design.pulls", "the pulls that bring a finger to a target"),
    "fit": (
        "ccr_ros.cli.design.fit",
        "stiffness, Poisson's ratio and cable stretch from measurements",
    ),
    "gripper": ("ccr_ros.cli.design.gripper", "a whole gripper for an object"),
    "turn": (
        "ccr_ros.cli.design.turn",
        "how far a gripper turns an object it holds",
    ),
    "print": ("ccr_ros.cli.design.print", "a finger's parts as CSV and as a solid to print"),
}
