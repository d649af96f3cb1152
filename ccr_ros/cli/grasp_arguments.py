# SPDX-License-Identifier: Apache-2.0
"""The arguments that say what a gripper grasps, where it stands, and where the gripper points."""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

from ccr_ros.cli.options import number
from ccr_ros.design.curve_text import object_from_text
from ccr_ros.grasp.statics import Body, box_body, cylinder_body, mesh_body, sphere_body
from ccr_ros.model import ConvexMesh, InvalidValue, Pose, UnknownName

_STANDARD = 9.80665
_MESH = "mesh:FILE.stl"
_DOWN = {  # gravity in the frame of a gripper that points so
    "up": np.array([0.0, 0.0, -_STANDARD]),
    "down": np.array([0.0, 0.0, _STANDARD]),
    "sideways": np.array([-_STANDARD, 0.0, 0.0]),
}


def add_body_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the gripper, the object and where the gripper points."""
    need: Any = {"required": True}
    parser.add_argument("gripper", metavar="GRIPPER", help="gripper file, or a name in config/")
    parser.add_argument("--object", metavar="OBJECT", help="such as sphere:0.112", **need)
    parser.add_argument(
        "--center-height", metavar="M", help="of its centre above the bases [m]", **need
    )
    parser.add_argument("--mass", metavar="KG", default="0", help="of the object (default 0)")
    parser.add_argument(
        "--friction", metavar="MU", default="0", help="between it and the fingers (default 0)"
    )
    parser.add_argument(
        "--points",
        choices=_DOWN,
        default="up",
        help="where the gripper points (default up); sideways: gravity is along its -x",
    )


def body_from_args(args: argparse.Namespace) -> Body:
    """Return the object where it stands.

    Raises:
        InvalidValue, UnknownName, InvalidFile, MissingPackage: As for `body_from_text`.
    """
    return body_from_text(
        args.object,
        Pose(np.array([0.0, 0.0, number("--center-height", args.center_height, -10, 10)])),
        number("--mass", args.mass, 0, 1e3),
        number("--friction", args.friction, 0, 100),
    )


def gravity_from_args(args: argparse.Namespace) -> np.ndarray:
    """Return gravity (3,) [m/s^2] in the gripper's frame."""
    return _DOWN[args.points]


def body_from_text(text: str, pose: Pose, mass: float, friction: float) -> Body:
    """Return the body that a text names: see the help of `ccr grasp`.

    Raises:
        InvalidValue, UnknownName: It is none.
        InvalidFile, MissingPackage: A mesh cannot be read.
    """
    if text.startswith("mesh:"):
        file = text.removeprefix("mesh:")
        if not file:
            raise InvalidValue("--object", text, _MESH)
        return mesh_body(ConvexMesh.from_stl(file, 1e-3), mass, pose, friction)
    try:
        sized = object_from_text(text)
    except UnknownName as error:
        raise UnknownName(error.kind, error.name, (*error.valid, _MESH)) from None
    if sized.kind == "sphere":
        return sphere_body(sized.size[0], mass, pose, friction)
    if sized.kind == "cylinder":
        diameter, height = sized.size
        return cylinder_body(diameter, height, mass, pose, friction)
    return box_body(np.array(sized.size), mass, pose, friction)
