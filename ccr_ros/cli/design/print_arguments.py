# SPDX-License-Identifier: Apache-2.0
"""The options of parts to print, shared by the commands that write them, and what they write."""

from __future__ import annotations

import argparse
import re
from pathlib import Path

from ccr_ros.cli.options import number
from ccr_ros.design.part_tables import write_tables
from ccr_ros.design.parts import PrintOptions, finger_parts
from ccr_ros.design.solid import finger_solid, write_stl
from ccr_ros.model import Finger, InvalidFile

_DEFAULTS = PrintOptions()
_LENGTHS = {
    "--disk-thickness": ("disk_thickness", "thickness of the disks"),
    "--disk-outer-radius": ("outer_radius", "their radius (default: hole radius + hole diameter)"),
    "--hole-diameter": ("hole_diameter", "diameter of the cable holes"),
    "--base-plate": ("plate_diameter", "diameter of a round base plate (default: none)"),
    "--base-plate-thickness": ("plate_thickness", "its thickness"),
}


def add_print_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the parts."""
    for option, (key, text) in _LENGTHS.items():
        default = getattr(_DEFAULTS, key)
        shown = "" if "default" in text else f" (default {default})"
        parser.add_argument(option, metavar="M", dest=key, help=f"{text}{shown} [m]")
    parser.add_argument(
        "--routed-holes",
        action="store_true",
        help="only the holes that a cable runs through, not all clock holes",
    )


def options_from_args(args: argparse.Namespace) -> PrintOptions:
    """Return the options that the arguments give.

    Raises:
        InvalidValue: A value is no number, or out of its range.
    """
    given: dict[str, float] = {}
    for option, (key, _) in _LENGTHS.items():
        text = getattr(args, key)
        if text is not None:
            given[key] = number(option, text, 0, 1)
    return PrintOptions(**given, routed_only=args.routed_holes)


def output_folder(path: str) -> Path:
    """Return a folder to write into, made if it is not there.

    Raises:
        InvalidFile: It cannot be made.
    """
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InvalidFile(path, f"cannot be made a folder: {error.strerror}") from None
    return folder


def print_finger(finger: Finger, stem: str, options: PrintOptions, folder: Path) -> str:
    """Write tables and solid of a finger, and return what was written, for people."""
    parts = finger_parts(finger, options)
    solid = finger_solid(parts)
    paths = [*write_tables(parts, folder, stem), write_stl(solid, folder / f"{stem}.stl")]
    size = (solid.vertices.max(axis=0) - solid.vertices.min(axis=0)).round(1)
    head = (
        f"{stem}: {len(parts.disks)} disks of {2e3 * parts.outer_radius:g} mm,"
        f" {len(parts.holes)} holes; {solid.volume / 1e3:.2f} cm3 within"
        f" {size[0]:g} x {size[1]:g} x {size[2]:g} mm"
    )
    return "\n".join([head, *(f"  {path}" for path in paths)])


def stem_of(name: str) -> str:
    """Return a finger's name as the beginning of file names."""
    return re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_") or "finger"
