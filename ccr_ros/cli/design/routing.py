# SPDX-License-Identifier: Apache-2.0
"""Find the holes through which pulled cables bend a finger into a wanted shape.

FINGER is a finger file or the name of one in config/; its own cables do not matter. The shape is
--shape, where each disk shall be: a CSV file of disk centres (x, y, z; base to tip), or what
`ccr solve --json` has printed; or --curve, on which the disks are placed. A pull is a percentage
of the cable's rest length inside the finger, or metres; give one for each cable, one or two.
Exit code: 0 every disk within the tolerance, 1 the nearest shape is farther off, 2 bad input.

  ccr solve helical --pull main=4% --json > pose.json
  ccr design routing straight --shape pose.json --pull 4% -o found.yaml
  ccr design routing straight --curve helix:0.05,turns=0.25 --pull 4% --free   (0.85 mm off at best)
"""

from __future__ import annotations

import argparse
import json
from typing import Any

import numpy as np

from ccr_ros.cli.design.curve_arguments import add_shape_arguments, wanted_from_args
from ccr_ros.cli.design.written import print_files
from ccr_ros.cli.options import integer, number
from ccr_ros.cli.solve import parse_pull
from ccr_ros.design.pull import Pull
from ccr_ros.design.routing import MAX_CABLES, TOLERANCE, design_routing
from ccr_ros.design.routing_result import RoutingCandidate, RoutingDesign
from ccr_ros.model import Finger, FingerSolver, InvalidValue
from ccr_ros.model.files import load_finger
from ccr_ros.model.finger_text import write_finger
from ccr_ros.resources import find_config
from ccr_ros.viz.figures import checked_path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument("finger", metavar="FINGER", help="finger file, or a name in config/")
    add_shape_arguments(parser)
    parser.add_argument(
        "--pull",
        metavar="VALUE",
        action="append",
        default=[],
        help="pull of a cable: 4%% or 0.0073 [m]; once per cable",
    )
    parser.add_argument(
        "--cables", metavar="K", help=f"number of cables, 1 to {MAX_CABLES} (default: of pulls)"
    )
    parser.add_argument("--free", action="store_true", help="holes at any angle, not the finger's")
    parser.add_argument(
        "--largest-change", metavar="K", help="of a hole from a disk to the next (default: any)"
    )
    parser.add_argument(
        "--no-frames", action="store_true", help="use the disk centres alone of --shape FILE.json"
    )
    parser.add_argument(
        "--candidates", metavar="K", default="5", help="list the best K routings (default 5)"
    )
    parser.add_argument(
        "--tolerance",
        metavar="MM",
        default=f"{TOLERANCE * 1e3:g}",
        help="largest error of a disk in mm (default %(default)s)",
    )
    parser.add_argument("-o", "--output", metavar="FILE.yaml", help="write the finger to a file")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--plot", metavar="FILE.png", help="draw it (needs matplotlib)")


def run(args: argparse.Namespace) -> int:
    """Search, write, print and plot; return the exit code."""
    if args.plot:
        checked_path(args.plot)  # before any work is done
    finger = load_finger(find_config(args.finger))
    shape = wanted_from_args(args, finger, frames=not args.no_frames)
    design = design_routing(
        finger,
        shape,
        _pulls(args),
        free=args.free,
        largest_change=None if args.largest_change is None else _change(args, finger),
        candidates=integer("--candidates", args.candidates, 1, 20),
        tolerance=number("--tolerance", args.tolerance, 1e-9, 1e3) / 1e3,
    )
    if args.output:
        write_finger(design.best.finger, args.output, _comment(design))
    if args.json:
        print(json.dumps(_json(design)))
    else:
        _print_table(design)
    if args.plot:
        from ccr_ros.viz.design_plot import plot_design

        solver = FingerSolver(design.best.finger)
        plot_design(args.plot, design.best.solution, shape, rest=solver.rest)
    print_files(args)
    return 0 if design.reached else 1


def _change(args: argparse.Namespace, finger: Finger) -> int:
    return integer("--largest-change", args.largest_change, 0, finger.holes_per_disk)


def _pulls(args: argparse.Namespace) -> list[Pull]:
    if not args.pull:
        raise InvalidValue("--pull", None, "given, once for each cable: 4% or 0.0073 [m]")
    if args.cables is not None:
        count = integer("--cables", args.cables, 1, MAX_CABLES)
        if count != len(args.pull):
            raise InvalidValue("--pull", args.pull, f"given once for each of {count} cables")
    return [Pull(*parse_pull("--pull", text)) for text in args.pull]


def _comment(design: RoutingDesign) -> str:
    best = design.best
    names = best.finger.cable_names
    pulls = ", ".join(
        f"{n} {p * 1e3:.4f} mm" for n, p in zip(names, best.solution.pulls, strict=True)
    )
    return (
        f"Routing by `ccr design routing`, for pulls of {pulls}.\n"
        f"Disks are off the wanted shape by {best.max_error * 1e3:.3g} mm at most."
    )


def _routing(candidate: RoutingCandidate) -> dict[str, Any]:
    """Holes, or angles [rad], by cable."""
    cables = candidate.finger.cables
    if candidate.holes is not None:
        return {c.name: list(holes) for c, holes in zip(cables, candidate.holes, strict=True)}
    return {c.name: c.angles.tolist() for c in cables}


def _json(design: RoutingDesign) -> dict[str, Any]:
    def entry(candidate: RoutingCandidate) -> dict[str, Any]:
        solution, names = candidate.solution, candidate.finger.cable_names
        return {
            "holes" if candidate.holes is not None else "angles": _routing(candidate),
            "pulls": dict(zip(names, solution.pulls.tolist(), strict=True)),
            "tensions": dict(zip(names, solution.tensions.tolist(), strict=True)),
            "max_error": candidate.max_error,
            "rms_error": candidate.rms_error,
            "errors": candidate.errors.tolist(),
            "turn": candidate.turn,
            "backbone": solution.backbone.tolist(),
            "stable": solution.certificate.stable,
            "branch_jump": solution.certificate.branch_jump,
        }

    return {
        "finger": design.best.finger.name,
        "reached": design.reached,
        "tolerance": design.tolerance,
        "alike": design.alike,
        "note": design.note,
        "candidates": [entry(c) for c in design.candidates],
    }


def _print_table(design: RoutingDesign) -> None:
    best = design.best
    finger, solution = best.finger, best.solution
    print(f"{finger.name}: {finger.length * 1e3:g} mm, {finger.segments} segments\n")
    unit = "N" if finger.forces_are == "newton" else "1/m2 (per EI)"
    for cable, pull, tension in zip(finger.cables, solution.pulls, solution.tensions, strict=True):
        print(f"  {cable.name}: pull {pull * 1e3:.3f} mm, tension {tension:.4g} {unit}")
    angles = "holes" if best.holes is not None else "hole angles [deg]"
    print(f"\n  {'max. error':>11}{'RMS':>9} mm{'turn':>8} deg   {angles}, base to tip")
    for candidate in design.candidates:
        turn = "-" if candidate.turn is None else f"{np.degrees(candidate.turn):.2f}"
        lines = list(_lines(candidate))
        print(
            f"  {candidate.max_error * 1e3:>11.4f}{candidate.rms_error * 1e3:>9.4f}{turn:>11}"
            f"       {lines[0]}{_remark(candidate)}"
        )
        for line in lines[1:]:
            print(f"{'':>40}{line}")
    limit = f"{design.tolerance * 1e3:g} mm"
    if not design.reached:
        print(f"\n  NOT REACHED: no routing found brings every disk within {limit}; nearest first")
    elif design.alike > 1:
        print(f"\n  reached; {design.alike} routings bring every disk within {limit}")
    else:
        print(f"\n  reached: every disk within {limit}")
    if design.note:
        print(f"  {design.note}")


def _lines(candidate: RoutingCandidate) -> list[str]:
    """One line for each cable."""
    if candidate.holes is not None:
        return [" ".join(f"{h:>2}" for h in holes) for holes in candidate.holes]
    return [
        " ".join(f"{a:.1f}" for a in np.degrees(cable.angles)) for cable in candidate.finger.cables
    ]


def _remark(candidate: RoutingCandidate) -> str:
    certificate = candidate.solution.certificate
    words = [] if certificate.stable else ["not stable"]
    words += ["jumped to another branch"] if certificate.branch_jump else []
    words += ["a cable is slack"] if candidate.solution.slack.any() else []
    return f"  ({', '.join(words)})" if words else ""
