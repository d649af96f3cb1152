# SPDX-License-Identifier: Apache-2.0
"""The wanted curve as arguments of a command, shared by the commands that take one."""

from __future__ import annotations

import argparse

from ccr_ros.design.curve_files import UNITS
from ccr_ros.design.curve_text import FAMILIES, curve_from_text
from ccr_ros.design.curves import Curve
from ccr_ros.design.placement import place
from ccr_ros.design.shape_files import load_shape
from ccr_ros.design.target import DesiredShape
from ccr_ros.model import Finger, InvalidValue


def add_curve_arguments(parser: argparse.ArgumentParser, required: bool = True) -> None:
    """Declare ``--curve``, which must be given unless told otherwise, and ``--unit``."""
    parser.add_argument(
        "--curve",
        metavar="CURVE",
        required=required,
        help="the wanted backbone curve, in the frame of the finger's base: a CSV file of points"
        f" (x, y, z), or one of {', '.join(FAMILIES.values())}; lengths in m, angles in degrees",
    )
    parser.add_argument(
        "--unit", choices=sorted(UNITS), default="m", help="of the points in the file (default m)"
    )


def curve_from_args(args: argparse.Namespace, finger: Finger) -> Curve:
    """Return the curve that the arguments name.

    Raises:
        InvalidValue, UnknownName, InvalidFile: They name none, or a value of it is not allowed.
    """
    return curve_from_text(args.curve, finger, args.unit)


def shape_from_args(args: argparse.Namespace, finger: Finger) -> DesiredShape:
    """Return the wanted shape: the finger's disks placed on the curve that the arguments name.

    Raises:
        InvalidValue, UnknownName, InvalidFile: As `curve_from_args`, or the finger does not fit
            the curve; see `place`.
    """
    return place(curve_from_args(args, finger), finger)


def add_shape_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare ``--shape`` and the curve's arguments, of which one is to be given."""
    parser.add_argument(
        "--shape", metavar="FILE", help="disk centres as CSV, or a pose of `ccr solve --json`"
    )
    add_curve_arguments(parser, required=False)


def wanted_from_args(args: argparse.Namespace, finger: Finger, frames: bool = True) -> DesiredShape:
    """Return the wanted shape that ``--shape`` or ``--curve`` gives.

    Args:
        frames: Whether to use the frames that a pose holds.

    Raises:
        InvalidValue, UnknownName, InvalidFile: Not one of the two is given, or as `load_shape` and
            `shape_from_args`.
    """
    if (args.shape is None) == (args.curve is None):
        given = "both" if args.shape else "neither"
        raise InvalidValue("--shape, --curve", given, "given, one of the two")
    if args.curve is not None:
        return shape_from_args(args, finger)
    return load_shape(args.shape, args.unit, frames)
