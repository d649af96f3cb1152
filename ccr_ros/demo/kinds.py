# SPDX-License-Identifier: Apache-2.0
"""The demos that there are: of the sphere and of the cube."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ccr_ros.model import UnknownName
from ccr_ros.resources import config_dir, find_config
from ccr_ros.stack.parts import Part
from ccr_ros.viz.recording import Recording, SolidObject

from . import cube_scene
from .cube_summary import cube_lines
from .design import FILES, design_for_ball
from .summary import phase_lines

if TYPE_CHECKING:
    from rclpy.node import Node

    from .story import Story


@dataclass(frozen=True)
class DemoKind:
    """What one demo has that the other has not.

    Attributes:
        gripper: Makes or finds the gripper file; returns it and a line about it.
        files: Names of the files that this leaves in the demo's folder.
        world: The node in place of a real object.
        story: Makes what plays the story, for the node it talks through and a time to hold [s].
        lines: What is told of a recording at the end.
        done: What has been done then, in words.
        parameter_files: For all nodes.
        shown: Phases of which the strip shows the ends; none: where most happens.
        support: What is drawn under the object while it stands.
    """

    gripper: Callable[[Path], tuple[Path, str]]
    files: tuple[str, ...]
    world: Part
    story: Callable[[Node, float], Story]
    lines: Callable[[Recording], list[str]]
    done: str
    parameter_files: tuple[Path, ...] = ()
    shown: tuple[str, ...] = ()
    support: tuple[SolidObject, ...] = ()


BALL_NODE = Part("demo_ball", ("ccr_ros.demo", "ball"), "ccr_ros.demo.ball:BallNode")
CUBE_NODE = Part("demo_cube", ("ccr_ros.demo", "cube"), "ccr_ros.demo.cube:CubeNode")
NAMES = ("sphere", "cube")


def demo_kind(name: str) -> DemoKind:
    """Return the demo of this name.

    Raises:
        UnknownName: There is none.
    """
    if name not in NAMES:
        raise UnknownName("demo", name, NAMES)
    return _cube() if name == "cube" else _sphere()


def _sphere() -> DemoKind:
    return DemoKind(
        gripper=design_for_ball,
        files=FILES,
        world=BALL_NODE,
        story=_sphere_story,
        lines=phase_lines,
        done="grasped, held and let go",
    )


def _cube() -> DemoKind:
    return DemoKind(
        gripper=_cube_gripper,
        files=(),
        world=CUBE_NODE,
        story=_cube_story,
        lines=cube_lines,
        done="grasped, turned to both sides, put down and let go",
        parameter_files=(config_dir() / "nodes" / f"{cube_scene.GRIPPER_FILE}.yaml",),
        shown=("close", "turn left", "turn right", "put down", "open"),
        support=cube_scene.TABLE,
    )


def _cube_gripper(folder: Path) -> tuple[Path, str]:
    path = find_config(cube_scene.GRIPPER_FILE)
    return path, f"the gripper is {path}"


# Here rclpy must be importable by now.


def _sphere_story(node: Node, hold: float) -> Story:
    from .show import Show

    return Show(node, hold)


def _cube_story(node: Node, hold: float) -> Story:
    from .cube_show import CubeShow

    return CubeShow(node, hold)
