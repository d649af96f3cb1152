# SPDX-License-Identifier: Apache-2.0
"""Design a gripper for an object: pre-bent fingers that a pull lays on its contour.

OBJECT is sphere:DIAMETER, cylinder:DIAMETERxHEIGHT or box:LENGTHxWIDTHxHEIGHT, upright, its centre
--center-height above the plane of the fingers' bases. These stand evenly around it, --base-radius
from its axis; around a box (2, 3 or 4 fingers) each faces a side. Every finger follows the contour
of the object, a disk's radius off it, below and above its middle. Writes a gripper file and its
finger file for `ccr up`, `ccr run solver_node` and `ccr solve`. The proof is the forward model,
pulled from rest with the object in place. Lengths in m. Exit code: 0 the fingers get there, stable
and without a jump; 1 they do not, or no rest shape was found; 2 the input cannot be.

  ccr design gripper --object sphere:0.112 --center-height 0.110 --base-radius 0.042 --fingers 3 \\
      --pull 3% --out design
  ccr design gripper --object box:0.06x0.06x0.14 --center-height 0.13 --base-radius 0.042 \\
      --fingers 4 --pull 3% --press 0.5 --print parts
"""

from __future__ import annotations

import argparse
import json
import shlex
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ccr_ros.cli.options import file_name, integer, number
from ccr_ros.cli.solve import parse_pull
from ccr_ros.design.curve_text import object_from_text
from ccr_ros.design.gripper import GripperDesign, GripperTask, NoRestShape, design_gripper
from ccr_ros.design.gripper_files import write_gripper
from ccr_ros.design.gripper_layout import MOST_FINGERS, GripperLayout
from ccr_ros.design.gripper_report import kinds_of, report, summary, to_dict
from ccr_ros.design.pull import Pull
from ccr_ros.model import Finger, FingerSolver, InvalidValue, UnknownName
from ccr_ros.model.files import load_finger
from ccr_ros.resources import find_config
from ccr_ros.viz.figures import checked_path

from .print_arguments import (
    add_print_arguments,
    options_from_args,
    output_folder,
    print_finger,
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    need: Any = {"required": True}
    parser.add_argument(
        "--object", metavar="OBJECT", help="what to grip, such as sphere:0.112", **need
    )
    parser.add_argument(
        "--center-height", metavar="M", help="of its centre above the bases [m]", **need
    )
    parser.add_argument("--base-radius", metavar="M", help="of the bases from its axis [m]", **need)
    parser.add_argument("--fingers", metavar="K", default="3", help="how many (default 3)")
    parser.add_argument(
        "--pull",
        metavar="[CABLE=]VALUE",
        action="append",
        help="pull at which the fingers lie on the object: 3%% of the cable's rest length, or"
        " 0.0055 [m]; once per cable",
        **need,
    )
    parser.add_argument(
        "--finger",
        metavar="FINGER",
        default="sphere_finger",
        help="finger file, or a name in config/: geometry, material and cables of the fingers"
        " (default %(default)s); its rest shape does not matter",
    )
    parser.add_argument("--length", metavar="M", help="another length of the fingers [m]")
    parser.add_argument(
        "--press",
        metavar="N",
        default="0",
        help="force of one finger on the object [N], shared by its disks on the contour (default 0:"
        " it only touches)",
    )
    parser.add_argument(
        "--clearance", metavar="M", default="0", help="of the disks from the object (default 0) [m]"
    )
    parser.add_argument(
        "--join",
        metavar="M",
        help="where the fingers come to the contour, along it from the object's middle upwards"
        " (default: where they bend least on the way) [m]",
    )
    parser.add_argument(
        "--name",
        metavar="NAME",
        help="of the gripper; its fingers are NAME_finger (default gripper_OBJECT, OBJECT_finger)",
    )
    parser.add_argument("--out", metavar="DIR", default=".", help="folder to write into (made)")
    parser.add_argument("--plot", metavar="FILE.png", help="draw the first finger's design")
    parser.add_argument("--strip", metavar="FILE.png", help="draw the gripper as it closes")
    parser.add_argument("--replay", metavar="FILE.html", help="write that as a replay")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument(
        "--print", metavar="DIR", dest="print_folder", help="write parts to print into a folder"
    )
    add_print_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Design, write and print; return the exit code."""
    for path in (args.plot, args.strip):  # before any work is done
        if path:
            made = Path(path).parent == Path(args.out)  # that folder may not be there yet
            checked_path(Path(path).name if made else path)
    if args.name is not None:
        file_name("--name", args.name)
    options = options_from_args(args)
    task = _task(args)
    kind = task.layout.body.kind
    name = args.name or f"gripper_{kind}"
    try:
        design = design_gripper(task, name)
    except NoRestShape as error:
        print(f"ccr: {error}", file=sys.stderr)
        return 1
    kinds = kinds_of(design)
    command = "ccr design gripper " + _command(args)
    paths = write_gripper(
        design.gripper,
        kinds,
        output_folder(args.out),
        task.template.name,
        comment=f"Made by: {command}",
        finger_comments=[
            f"{summary(design.fingers[kinds.index(k)])}\nMade by: {command}"
            for k in range(max(kinds) + 1)
        ],
    )
    if args.json:
        print(json.dumps({**to_dict(design), "files": [str(path) for path in paths]}))
    else:
        print(report(design))
        for path in paths:
            print(f"  {path}")
    _draw(args, design)
    if args.print_folder:
        folder = output_folder(args.print_folder)
        for k in range(max(kinds) + 1):
            finger = design.gripper.fingers[kinds.index(k)].finger
            text = print_finger(finger, paths[1 + k].stem, options, folder)
            if not args.json:
                print(text)
    return 0 if design.reached else 1


def _task(args: argparse.Namespace) -> GripperTask:
    template = load_finger(find_config(args.finger))
    body = object_from_text(args.object)
    template = replace(template, name=f"{args.name or body.kind}_finger")
    if args.length is not None:
        template = replace(
            template, length=number("--length", args.length, 1e-3, 1e3), rest_curvature=None
        )
    layout = GripperLayout(
        body,
        number("--center-height", args.center_height, -1e3, 1e3),
        number("--base-radius", args.base_radius, 1e-3, 1e3),
        integer("--fingers", args.fingers, 2, MOST_FINGERS),
    )
    return GripperTask(
        layout,
        template,
        _pulls(args.pull, template),
        clearance=number("--clearance", args.clearance, 0, 1),
        press=number("--press", args.press, 0, 1e9),
        join=None if args.join is None else number("--join", args.join, -1e3, 1e3),
    )


def _pulls(words: list[str], finger: Finger) -> dict[str, Pull]:
    pulls: dict[str, Pull] = {}
    cables = ", ".join(finger.cable_names)
    for word in words:
        cable, equals, text = word.rpartition("=")
        if not equals and len(finger.cables) > 1:
            raise InvalidValue("--pull", word, f"CABLE={word}, CABLE one of {cables}")
        cable = cable or finger.cable_names[0]
        if cable not in finger.cable_names:
            raise UnknownName("cable", cable, finger.cable_names)
        if cable in pulls:
            raise InvalidValue(f"--pull {cable}", word, "given once per cable")
        pulls[cable] = Pull(*parse_pull(f"--pull {cable}", text))
    return pulls


def _command(args: argparse.Namespace) -> str:
    """The arguments that decide the design, as they may be given again."""
    words = ["--object", args.object, "--center-height", args.center_height]
    words += ["--base-radius", args.base_radius, "--fingers", args.fingers]
    for pull in args.pull:
        words += ["--pull", pull]
    for option, value, default in (
        ("--finger", args.finger, "sphere_finger"),
        ("--length", args.length, None),
        ("--press", args.press, "0"),
        ("--clearance", args.clearance, "0"),
        ("--join", args.join, None),
    ):
        if value != default:
            words += [option, value]
    return shlex.join(words)


def _draw(args: argparse.Namespace, design: GripperDesign) -> None:
    """Draw what was asked for."""
    if args.plot:
        from ccr_ros.viz.design_plot import plot_design

        finger = design.fingers[0]
        curve = finger.curve.points(np.linspace(0, finger.curve.length, 300))
        rest = FingerSolver(finger.finger).rest
        plot_design(args.plot, finger.solution, finger.shape, rest=rest, curve=curve)
    if args.strip or args.replay:
        from ccr_ros.viz.design_recording import recording_of_design
        from ccr_ros.viz.replay import write_replay
        from ccr_ros.viz.strip import write_strip

        recording = recording_of_design(design)
        if args.strip:
            write_strip(recording, args.strip)
        if args.replay:
            write_replay(recording, args.replay)
    for path in (args.plot, args.strip, args.replay):
        if path and not args.json:
            print(f"  {path}")
