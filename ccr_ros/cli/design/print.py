# SPDX-License-Identifier: Apache-2.0
"""Write a finger's parts at rest, as CSV tables and as a solid to print.

FINGER is a finger file, or the name of one in config/. Into the folder go, in millimetres:
NAME_backbone.csv (centreline), NAME_disks.csv (their planes), NAME_holes.csv (their axes) and
NAME.stl (backbone, disks with all holes, base plate; one watertight solid). Lengths in m.

  ccr design print sphere_finger --out parts
  ccr design print helical --base-plate 0.05 --disk-thickness 0.0025
"""

from __future__ import annotations

import argparse

from ccr_ros.model.files import load_finger
from ccr_ros.resources import find_config

from .print_arguments import (
    add_print_arguments,
    options_from_args,
    output_folder,
    print_finger,
    stem_of,
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument("finger", metavar="FINGER", help="finger file, or a name in config/")
    parser.add_argument("--out", metavar="DIR", default=".", help="folder to write into (made)")
    add_print_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Write the parts; return the exit code."""
    options = options_from_args(args)
    finger = load_finger(find_config(args.finger))
    print(print_finger(finger, stem_of(finger.name), options, output_folder(args.out)))
    return 0
