# SPDX-License-Identifier: Apache-2.0
"""Command a gripper that runs (`ccr up`, or the nodes under ROS 2): grasp, move, rotate, release.

Millimetres, degrees and newtons. Every command waits until it is done and prints what became of it.
Exit code: 0 done, 1 begun but not done (what is held is still held), 2 refused, bad input or no
gripper there.

  ccr gripper grasp --object cube --force 0.4
  ccr gripper rotate 15
  ccr gripper move --shift 0,0,-1 --turn 0,0,5 --margin 0.2
  ccr gripper rotate -90 --partial         # as far as it goes; says what keeps it from there
  ccr gripper release --after 5
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from ccr_ros.cli.options import number
from ccr_ros.gripper_reports import GraspReport, GripperReport, MoveReport
from ccr_ros.model.errors import InvalidValue

if TYPE_CHECKING:
    from ccr_ros.gripper import Gripper

_MM = 1e3
_LONGEST = 86400.0  # s


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verbs and their arguments."""
    parser.add_argument("--namespace", metavar="NS", default="/gripper", help="default: /gripper")
    verbs = parser.add_subparsers(dest="verb", metavar="VERB", required=True)
    for verb, (_, text) in _VERBS.items():
        own = verbs.add_parser(verb, help=text, description=f"{text}.")
        if verb == "grasp":
            own.add_argument("--object", metavar="NAME", default="", help="default: whatever")
            own.add_argument("--force", metavar="N", default="0", help="of each finger [N]")
            own.add_argument("--timeout", metavar="S", default="30", help="default 30 s")
        elif verb == "release":
            own.add_argument("--after", metavar="S", default="0", help="until it begins [s]")
            own.add_argument("--fast", action="store_true", help="at the fast speed")
        elif verb in ("move", "rotate"):
            _add_motion(own, verb)


def _add_motion(parser: argparse.ArgumentParser, verb: str) -> None:
    if verb == "rotate":
        parser.add_argument("angle", metavar="DEG", help="about the gripper's z axis [deg]")
    else:
        parser.add_argument("--shift", metavar="X,Y,Z", default="0,0,0", help="of its centre [mm]")
        parser.add_argument(
            "--turn", metavar="X,Y,Z", default="0,0,0", help="rotation vector about it [deg]"
        )
    parser.add_argument("--margin", metavar="M", default="0", help="least friction margin, below 1")
    parser.add_argument("--duration", metavar="S", default="0", help="of the motion [s]")
    parser.add_argument("--speed", metavar="MM/S", default="0", help="of the pulls [mm/s]")
    parser.add_argument(
        "--partial", action="store_true", help="go as far as is possible where it is not reached"
    )
    parser.add_argument("--timeout", metavar="S", default="300", help="default 300 s")


def run(args: argparse.Namespace) -> int:
    """Do what the verb says; return the exit code."""
    act: Callable[[Gripper], Any] = _VERBS[args.verb][0](args)
    from ccr_ros.gripper import Gripper, GripperFailed

    with Gripper(args.namespace) as gripper:
        try:
            report = act(gripper)
            code = 0
        except GripperFailed as error:
            report, code = error.report, 1
        print(text_of(report))
        if args.verb == "state" and (thing := gripper.in_hand) is not None:
            print(text_of(thing))
    return code


def triple(option: str, text: str, largest: float) -> list[float]:
    """Return the three numbers in a text such as ``0,0,-1``.

    Raises:
        InvalidValue: It is not that; the error names the option.
    """
    words = text.split(",")
    if len(words) != 3:
        raise InvalidValue(option, text, "three numbers with commas between, such as 0,0,-1")
    return [number(option, word, -largest, largest) for word in words]


def text_of(report: GripperReport | MoveReport | GraspReport) -> str:
    """Return a report in a person's words and units."""
    if isinstance(report, GraspReport):
        held = "held" if report.held else "not held"
        place = ", ".join(f"{_MM * value:.2f}" for value in report.position)
        text = f"  {report.object}: {held}, at {place} mm, {report.mass:g} kg"
        if not math.isnan(report.margin):
            text += f", friction margin {report.margin:.2f}"
        return text + (f"\n  {report.message}" if report.message else "")
    head = f"{report.state}: {report.message}"
    if isinstance(report, MoveReport):
        shift = ", ".join(f"{_MM * value:.2f}" for value in report.shift)
        turn = ", ".join(f"{math.degrees(value):.2f}" for value in report.turn)
        head += f"\n  shift {shift} mm, turn {turn} deg"
        return head if math.isnan(report.margin) else f"{head}, friction margin {report.margin:.2f}"
    if report.in_contact:
        forces = (f"{name} {report.forces[name]:.3f} N" for name in report.in_contact)
        head += f"\n  {', '.join(forces)}"
    return head


# What the verbs do: the arguments are checked at once, before a gripper is looked for.


def _grasp(args: argparse.Namespace) -> Callable[[Gripper], Any]:
    force = number("--force", args.force, 0, 1e3)
    timeout = number("--timeout", args.timeout, 0.1, 3600)
    return lambda gripper: gripper.grasp(args.object, force=force, timeout=timeout)


def _release(args: argparse.Namespace) -> Callable[[Gripper], Any]:
    after = number("--after", args.after, 0, _LONGEST)
    return lambda gripper: gripper.release(after=after, fast=args.fast)


def _motion(args: argparse.Namespace) -> dict[str, Any]:
    return {
        "margin": number("--margin", args.margin, 0, 0.99),
        "duration": number("--duration", args.duration, 0, 3600),
        "speed": number("--speed", args.speed, 0, 100) / _MM,
        "partial": args.partial,
        "timeout": number("--timeout", args.timeout, 0.1, _LONGEST),
    }


def _move(args: argparse.Namespace) -> Callable[[Gripper], Any]:
    shift = [value / _MM for value in triple("--shift", args.shift, 1e3)]
    turn = [math.radians(value) for value in triple("--turn", args.turn, 180)]
    values = _motion(args)
    return lambda gripper: gripper.move(shift, turn, **values)


def _rotate(args: argparse.Namespace) -> Callable[[Gripper], Any]:
    angle = math.radians(number("DEG", args.angle, -180, 180))
    values = _motion(args)
    return lambda gripper: gripper.rotate(angle, **values)


_VERBS: dict[str, tuple[Callable[[argparse.Namespace], Callable[[Gripper], Any]], str]] = {
    "state": (lambda args: lambda gripper: gripper.state, "What the gripper says of itself"),
    "grasp": (_grasp, "Close on an object and hold it"),
    "hold": (lambda args: lambda gripper: gripper.hold(), "Hold what is gripped as it is"),
    "move": (_move, "Shift and turn what is held"),
    "rotate": (_rotate, "Turn what is held about the gripper's z axis"),
    "release": (_release, "Let go"),
    "stop": (lambda args: lambda gripper: gripper.stop(), "Freeze the fingers; the grip is kept"),
    "reset": (lambda args: lambda gripper: gripper.reset(), "Leave a fault; nothing moves"),
}
