# SPDX-License-Identifier: Apache-2.0
"""How far a gripper turns an object in hand, and a search for one that turns it farther.

GRIPPER is a gripper file or the name of one in config/ (gripper_cube). OBJECT is sphere:DIAMETER,
cylinder:DIAMETERxHEIGHT, box:LENGTHxWIDTHxHEIGHT, or mesh:FILE.stl, upright, its centre
--center-height above the plane of the fingers' bases. It stands there while the fingers close until
each presses with its --force; then it is let go, and turned about the gripper's z axis, left (+z)
and right (-z), as far as every contact keeps its --margin and nothing else ends it.

With --try, other grippers like this one are tried: the holes their cables run through, their
bases, where they touch the object, and how hard. The score in degrees is the lesser of both turns
(up to --cap), plus 20 times the margin of the hold, less 0.25 for each hole a cable winds by.
Mirrored fingers stay mirrored; the same --seed finds the same. Ctrl-C ends the search with the best
so far. Lengths in m. Exit code: 0 it turns by --angle both ways, 1 it does not, 2 bad input.

  ccr design turn gripper_cube --object box:0.04x0.04x0.04 --center-height 0.17 --mass 0.01 \\
      --friction 0.8 --force 0.06 --force finger_1=0.12 --plot turn.png
  ccr design turn gripper_cube --object box:0.04x0.04x0.04 --center-height 0.17 --mass 0.01 \\
      --friction 0.8 --force 0.06 --force finger_1=0.12 --try 50 --output better
"""

from __future__ import annotations

import argparse
import json
import math
import shlex
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

from ccr_ros.cli.grasp_arguments import add_body_arguments, body_from_args, gravity_from_args
from ccr_ros.cli.options import file_name, integer, number
from ccr_ros.design.gripper_files import write_gripper
from ccr_ros.design.turn import TurnResult, TurnTask, evaluate_turn, record_turn, scaled
from ccr_ros.design.turn_search import TurnDesign, TurnSearch, search_turn
from ccr_ros.design.turn_units import kinds_of
from ccr_ros.grasp.manipulation import MoveLimits
from ccr_ros.grasp.quality import payload_until_slip
from ccr_ros.model import Gripper, InvalidValue, SolverSettings, UnknownName, load_gripper
from ccr_ros.resources import find_config
from ccr_ros.viz.figures import checked_path

from .print_arguments import output_folder
from .turn_report import report, search_to_dict, summary, to_dict

_TIME_LIMIT = 30.0  # s per solve
_TRY_STEP, _TRY_WAYPOINTS, _TRY_PATIENCE = 2e-4, 60, 5  # of a search, which looks less closely


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    add_body_arguments(parser)
    parser.add_argument(
        "--force",
        metavar="[FINGER=]N",
        action="append",
        required=True,
        help="normal force of every finger, or of one, before the object is let go; later ones"
        " count [N]",
    )
    parser.add_argument("--angle", metavar="DEG", default="20", help="wanted (default 20)")
    parser.add_argument(
        "--margin", metavar="M", default="0.1", help="least friction margin (default 0.1)"
    )
    parser.add_argument(
        "--drift",
        metavar="M",
        default="0.006",
        help="largest motion beside the turn, a tilt counted at 20 mm (default 0.006) [m]",
    )
    parser.add_argument(
        "--step", metavar="M", default="0.00005", help="largest pull in one step (default 5e-5) [m]"
    )
    parser.add_argument(
        "--until-slip", action="store_true", help="also the weight at which the object is lost"
    )
    parser.add_argument("--try", metavar="N", dest="tries", help="search: so many other grippers")
    parser.add_argument("--seed", metavar="K", default="0", help="of the search (default 0)")
    parser.add_argument(
        "--cap", metavar="DEG", default="45", help="turns count up to this (default 45)"
    )
    parser.add_argument("--output", metavar="DIR", help="write the best gripper into a folder")
    parser.add_argument("--name", metavar="NAME", help="its name (default: as it is)")
    parser.add_argument("--plot", metavar="FILE.png", help="draw the turn of the (best) gripper")
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def run(args: argparse.Namespace) -> int:
    """Evaluate, search if asked to, write, draw and print; return the exit code."""
    if args.plot is not None:
        checked_path(args.plot)
    if args.output is not None and args.tries is None:
        raise InvalidValue("--output", args.output, "given with --try, which finds what to write")
    gripper = load_gripper(find_config(args.gripper))
    angle = math.radians(number("--angle", args.angle, 0.1, 90))
    task = _task(args, gripper)
    name = gripper.name if args.name is None else file_name("--name", args.name)
    folder = None if args.output is None else output_folder(args.output)  # not after hours
    settings = SolverSettings(time_limit=_TIME_LIMIT)
    search = None
    if args.tries is not None:
        search = _searched(args, gripper, task, settings)
        gripper, task = search.best.gripper, scaled(task, search.best.choice.force)
        gripper = replace(gripper, name=name)
    result = evaluate_turn(gripper.fingers, task, settings)
    loads = payload_until_slip(result.solver) if args.until_slip and result.held else None
    if args.json:
        found: dict[str, Any] = to_dict(gripper, task, result, angle, loads)
        if search is not None:
            found["search"] = search_to_dict(search)
        print(json.dumps(found))
    else:
        print(report(gripper, task, result, angle, loads))
    _leave(args, gripper, result, summary(task, result), folder)
    return 0 if result.reached(angle) else 1


def parse_forces(words: list[str], names: tuple[str, ...]) -> dict[str, float]:
    """Return the force [N] of each finger from words such as ``0.06``, ``finger_1=0.12``.

    Raises:
        InvalidValue: A word is none of these, or a finger is left without a force.
        UnknownName: A finger that is not there.
    """
    forces: dict[str, float] = {}
    for word in words:
        finger, equals, text = word.rpartition("=")
        if equals and finger not in names:
            raise UnknownName("finger", finger, names)
        value = number("--force", text, 1e-6, 1e6)
        forces.update(dict.fromkeys([finger] if equals else names, value))
    without = [name for name in names if name not in forces]
    if without:
        raise InvalidValue("--force", words, f"given for {', '.join(without)}, too")
    return {name: forces[name] for name in names}


def _task(args: argparse.Namespace, gripper: Gripper) -> TurnTask:
    limits = MoveLimits(
        margin=number("--margin", args.margin, 0, 0.99),
        drift=number("--drift", args.drift, 1e-4, 1),
        step=number("--step", args.step, 1e-6, 0.01),
    )
    body, forces = body_from_args(args), parse_forces(args.force, gripper.finger_names)
    return TurnTask(body, forces, limits, gravity_from_args(args))


def _searched(
    args: argparse.Namespace, gripper: Gripper, task: TurnTask, settings: SolverSettings
) -> TurnSearch:
    tries = integer("--try", args.tries, 1, 1_000_000)
    best = -1.0

    def watch(number: int, design: TurnDesign) -> bool:
        nonlocal best
        if design.score > best:
            best = design.score
            turns = " ".join(
                f"{math.degrees(way.plan.moved[5]):+.1f}"
                for way in (design.result.ways if design.result else ())
            )
            print(f"try {number}/{tries}: score {best:.2f}, turns {turns} deg", file=sys.stderr)
        return True

    coarse = replace(
        task,
        limits=replace(
            task.limits, step=max(task.limits.step, _TRY_STEP), waypoints=_TRY_WAYPOINTS
        ),
        patience=_TRY_PATIENCE,
        stall=math.radians(1.0),
    )
    cap = math.radians(number("--cap", args.cap, 1, 90))
    seed = integer("--seed", args.seed, 0, 2**63 - 1)
    return search_turn(gripper, coarse, tries, seed, cap=cap, settings=settings, watch=watch)


def _leave(
    args: argparse.Namespace,
    gripper: Gripper,
    result: TurnResult,
    text: str,
    folder: Path | None,
) -> None:
    """Write and draw what was asked for, and say so."""
    left: list[Path | str] = []
    if folder is not None:
        comment = f"{text}\nMade by: ccr design turn {_command(args)}"
        kinds = kinds_of(gripper)
        left += write_gripper(
            gripper, kinds, folder, f"{gripper.name}_finger", comment,
            [comment] * (max(kinds) + 1),
        )  # fmt: skip
    if args.plot is not None and result.ways:
        from ccr_ros.viz.turn_plot import plot_turn

        left.append(plot_turn(args.plot, gripper.name, record_turn(result), result))
    if not args.json:
        for path in left:
            print(f"  {path}")


def _command(args: argparse.Namespace) -> str:
    """The arguments that decide the design, as they may be given again."""
    words = [args.gripper, "--object", args.object, "--center-height", args.center_height]
    for option, value, default in (
        ("--mass", args.mass, "0"),
        ("--friction", args.friction, "0"),
        ("--points", args.points, "up"),
    ):
        words += [option, value] if value != default else []
    for force in args.force:
        words += ["--force", force]
    others: tuple[tuple[str, str, str | None], ...] = (
        ("--margin", args.margin, "0.1"),
        ("--drift", args.drift, "0.006"),
        ("--step", args.step, "0.00005"),
        ("--try", args.tries, None),
        ("--seed", args.seed, "0"),
        ("--cap", args.cap, "45"),
    )
    for option, value, unsaid in others:
        words += [option, value] if value != unsaid else []
    return shlex.join(words)
