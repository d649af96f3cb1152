# SPDX-License-Identifier: Apache-2.0
"""Find the pulls that bring a finger to a target, in the frame of its base.

FINGER is a finger file or the name of one in config/. Positions are in metres, or in mm with
--unit mm; orientations are quaternions x, y, z, w. The target is one of
  --tip X,Y,Z              the tip's centre; --tip X,Y,Z,QX,QY,QZ,QW: and its orientation
  --points FILE.csv        centres of disks: lines of disk, x, y, z (disk 0 is the base)
  --press DISK=FORCE       the disk presses an obstacle of the finger's file, in newtons (1/m2
                           where the file has no Young's modulus)
  --path FILE.csv          lines of x, y, z, or with an orientation: tracked one after the other
A slack cable is let out by 1 % of the finger's length. Out of reach, the nearest pose is told.
Exit code: 0 reached, 1 not (with --path: not everywhere), 2 bad input.

  ccr design pulls two_cables --tip=-0.001,0.03438,0.17727
  ccr design pulls contact_cylinder --press 7=0.3 --max-pull main=4% --plot press.png
  ccr design pulls two_cables --path circle.csv --unit mm -o pulls.csv
"""

from __future__ import annotations

import argparse
import json
import math
from typing import Any

import numpy as np

from ccr_ros.cli.design.pulls_report import as_json, print_answer, print_path, write_path
from ccr_ros.cli.design.written import print_files
from ccr_ros.cli.options import number
from ccr_ros.cli.solve import parse_pulls
from ccr_ros.design.curve_files import UNITS
from ccr_ros.design.pulls import PullPlanner, PullSolution
from ccr_ros.design.pulls_limits import PullLimits
from ccr_ros.design.pulls_targets import PointsTarget, PressTarget, Target, TipTarget
from ccr_ros.design.table_file import read_table
from ccr_ros.model import Finger, FingerSolver, InvalidFile, InvalidValue, UnknownName
from ccr_ros.model.files import load_finger
from ccr_ros.resources import find_config
from ccr_ros.viz.figures import checked_path

_TARGETS = ("tip", "points", "press", "path")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument("finger", metavar="FINGER", help="finger file, or a name in config/")
    parser.add_argument("--tip", metavar="X,Y,Z", help="where the tip shall be (--tip=-0.03,... )")
    parser.add_argument("--points", metavar="FILE.csv", help="where the centres of disks shall be")
    parser.add_argument("--press", metavar="DISK=FORCE", help="a disk that presses an obstacle")
    parser.add_argument("--obstacle", metavar="NAME", help="which (default: the finger's only one)")
    parser.add_argument("--path", metavar="FILE.csv", help="tip positions, or poses, to track")
    parser.add_argument(
        "--unit", choices=sorted(UNITS), default="m", help="of positions (default m)"
    )
    parser.add_argument(
        "--turn-weight",
        metavar="M",
        help="what a radian of the tip's orientation counts as [m] (default: 0.1 of the length)",
    )
    for option, text in (
        ("--max-tension", "largest tension of a cable: main=12 [N; 1/m2 without a modulus]"),
        ("--max-pull", "largest pull of a cable: main=4%% or main=0.0073 [m]"),
        ("--min-pull", "least pull of a cable, <= 0: main=-2%%, main=0"),
    ):
        parser.add_argument(option, metavar="CABLE=VALUE", action="append", default=[], help=text)
    parser.add_argument(
        "--tolerance",
        metavar="MM",
        default="0.01",
        help="how far off a tip or a disk may be to count as reached [mm] (default 0.01)",
    )
    parser.add_argument("--slack", metavar="M", help="how far slack cables are let out [m]")
    parser.add_argument("-o", "--output", metavar="FILE.csv", help="with --path: write the pulls")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--plot", metavar="FILE.png", help="draw the pose (needs matplotlib)")


def run(args: argparse.Namespace) -> int:
    """Search, print, write and plot; return the exit code."""
    if args.plot:
        checked_path(args.plot)  # before any work is done
    given = [name for name in _TARGETS if getattr(args, name) is not None]
    if len(given) != 1:
        options = ", ".join(f"--{name}" for name in _TARGETS)
        chosen = ", ".join(f"--{name}" for name in given) or "none"
        raise InvalidValue("target", chosen, f"exactly one of {options}")
    if args.output and not args.path:
        raise InvalidValue("--output", args.output, "given with --path only")
    finger = load_finger(find_config(args.finger))
    millimetres = number("--tolerance", args.tolerance, 1e-6, 1e3)
    # Forces have a tolerance of their own.
    tolerance = 1e-6 if args.press else min(millimetres / 1e3 / finger.length, 1e-2)
    planner = PullPlanner(
        FingerSolver(finger),
        _limits(args, finger),
        tolerance=tolerance,
        slack=None if args.slack is None else parse_number("--slack", args.slack),
    )
    targets = _path(args) if args.path else [_target(args, finger)]
    found = [planner.reach(targets[0])]
    found += planner.track(targets[1:])
    if args.output:
        write_path(args.output, targets, found)
    if args.json:
        print(json.dumps([as_json(f) for f in found] if args.path else as_json(found[0])))
    elif args.path:
        print_path(found)
    else:
        print_answer(found[0], planner.solver.rest_lengths)
    if args.plot:
        _plot(args, planner, targets, found)
    print_files(args)
    return 0 if all(f.reached for f in found) else 1


def _target(args: argparse.Namespace, finger: Finger) -> Target:
    weight = None if args.turn_weight is None else parse_number("--turn-weight", args.turn_weight)
    if args.tip is not None:
        return _tip("--tip", _numbers("--tip", args.tip), args.unit, weight)
    if args.points is not None:
        table = read_table(args.points, columns=4)
        points: dict[int, np.ndarray] = {}
        for (disk, *point), line in zip(table.values, table.lines, strict=True):
            if disk != int(disk) or not 1 <= disk <= finger.segments or int(disk) in points:
                where = f"line {line}: disk {disk:g}"
                allowed = f"each of 1..{finger.segments} once at most"
                raise InvalidFile(args.points, f"{where} is not allowed; must be {allowed}")
            points[int(disk)] = np.array(point) * UNITS[args.unit]
        return PointsTarget(points)
    disk, equals, force = args.press.partition("=")
    if not equals or not disk.isdecimal():
        raise InvalidValue("--press", args.press, "DISK=FORCE, such as 7=0.3")
    names = [obstacle.name for obstacle in finger.obstacles]
    if args.obstacle is None and len(names) != 1:
        if not names:
            raise InvalidValue("--press", args.press, "of a finger whose file has obstacles")
        raise InvalidValue("--obstacle", None, f"given: one of {', '.join(names)}")
    if args.obstacle is not None and args.obstacle not in names:
        raise UnknownName("obstacle", args.obstacle, names)
    return PressTarget(int(disk), args.obstacle or names[0], parse_number("--press", force))


def _path(args: argparse.Namespace) -> list[Target]:
    table = read_table(args.path)
    if table.values.shape[1] not in (3, 7):
        wanted = "3 or 7 values a line are wanted: x, y, z, or with a quaternion"
        raise InvalidFile(args.path, f"{wanted} (got {table.values.shape[1]})")
    weight = None if args.turn_weight is None else parse_number("--turn-weight", args.turn_weight)
    targets: list[Target] = []
    for row, line in zip(table.values, table.lines, strict=True):
        try:
            targets.append(_tip(f"line {line}", row.tolist(), args.unit, weight))
        except InvalidValue as error:
            raise InvalidFile(args.path, str(error)) from None
    return targets


def _tip(place: str, values: list[float], unit: str, weight: float | None) -> TipTarget:
    if len(values) not in (3, 7):
        raise InvalidValue(place, values, "3 numbers x,y,z or 7: x,y,z,qx,qy,qz,qw")
    position = np.array(values[:3]) * UNITS[unit]
    orientation = np.array(values[3:]) if len(values) == 7 else None
    return TipTarget(position, orientation, rotation_weight=weight)


def _limits(args: argparse.Namespace, finger: Finger) -> PullLimits:
    lengths = FingerSolver(finger).rest_lengths
    names = finger.cable_names
    tension: dict[str, float] = {}
    for word in args.max_tension:
        cable, equals, text = word.partition("=")
        if not equals:
            raise InvalidValue("--max-tension", word, "CABLE=VALUE, such as main=12")
        if cable in tension:
            raise InvalidValue(f"--max-tension {cable}", word, "given once per cable")
        tension[cable] = parse_number(f"--max-tension {cable}", text)
    low = parse_pulls(args.min_pull, names, lengths, "--min-pull")
    high = parse_pulls(args.max_pull, names, lengths, "--max-pull")
    return PullLimits.of(finger, tension, low, high)


def _plot(
    args: argparse.Namespace,
    planner: PullPlanner,
    targets: list[Target],
    found: list[PullSolution],
) -> None:
    from ccr_ros.viz.pulls_plot import plot_pulls

    wanted: list[Any] = []
    for target in targets:
        if isinstance(target, PointsTarget):
            wanted += list(target.points.values())
        elif isinstance(target, TipTarget):
            wanted.append(target.position)
    track = np.array([f.solution.backbone[-1] for f in found]) if args.path else None
    points = np.array(wanted).reshape(-1, 3)
    plot_pulls(args.plot, found[-1].solution, points, rest=planner.solver.rest, track=track)


def _numbers(option: str, text: str) -> list[float]:
    return [parse_number(option, word) for word in text.split(",")]


def parse_number(option: str, text: str) -> float:
    """Return a finite number from the text of an option.

    Raises:
        InvalidValue: It is none.
    """
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InvalidValue(option, text, "finite numbers")
    return value
