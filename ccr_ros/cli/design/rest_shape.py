# SPDX-License-Identifier: Apache-2.0
"""Find the rest shape that pulls bend into a wanted shape (the paper's algorithm Pre-bent).

FINGER is a finger file or the name of one in config/; its own rest shape does not matter. The
shape is --curve, on which the disks are placed, or --shape, where each disk shall be: a CSV file
of disk centres, or what `ccr solve --json` has printed. A pull is a percentage of the cable's
length in the rest shape that is found, or metres; cables that are not named are not pulled.
With several values (main=2%,3%) every one is designed for. Every rest shape found is pulled from
rest by the forward model, obstacles of the finger file and all. What no equilibrium gives exactly
(shapes out of reach or in an obstacle, a bound on curvature, --rest constant) takes --fit, the
nearest. Exit code: 0 the shape is reached, 1 it is not, 2 bad input.

  ccr design rest-shape sphere_finger --curve sphere:0.112,x=0.042,z=0.11 --pull main=3% -o a.yaml
  ccr design rest-shape helical --curve helix:0.02,turns=1 --pull main=2%,4% --plot found.png
  ccr design rest-shape finger.yaml --curve points.csv --pull main=3% --press 7:cable=0.2
  ccr design rest-shape straight --curve s:60 --pull main=3% --rest constant --tolerance 0.01
"""

from __future__ import annotations

import argparse
import itertools
import json
from collections.abc import Iterator, Sequence
from pathlib import Path

from ccr_ros.cli.design.curve_arguments import add_shape_arguments, wanted_from_args
from ccr_ros.cli.design.written import print_files
from ccr_ros.cli.options import integer, number
from ccr_ros.cli.solve import parse_pull
from ccr_ros.design.best_fit import BestFit, best_fit
from ccr_ros.design.press import Press
from ccr_ros.design.pull import Pull
from ccr_ros.design.rest_forward import KINDS
from ccr_ros.design.rest_report import Found, comment, print_table, to_dict
from ccr_ros.design.rest_shape import RestShape, RestShapeSolver
from ccr_ros.design.target import DesiredShape
from ccr_ros.design.verify import TOLERANCE, pull_from_rest
from ccr_ros.model import Finger, InvalidValue, NotConverged, UnknownName
from ccr_ros.model.files import load_finger
from ccr_ros.model.finger_text import write_finger
from ccr_ros.resources import find_config
from ccr_ros.viz.figures import checked_path

_MOST_PULLS = 100  # combinations that one command designs for


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument("finger", metavar="FINGER", help="finger file, or a name in config/")
    add_shape_arguments(parser)
    parser.add_argument(
        "--pull",
        metavar="CABLE=VALUE[,VALUE]",
        action="append",
        default=[],
        help="pull of a cable: main=3%% or main=0.0055 [m]; once per cable",
    )
    parser.add_argument(
        "--press",
        metavar="DISK[:POINT]=FORCE",
        action="append",
        default=[],
        help="normal force [N] with which a disk of the wanted shape presses on an obstacle of the"
        " finger file; POINT is backbone, cable, antagonist, cable.NAME or antagonist.NAME"
        " (default: the nearest)",
    )
    parser.add_argument(
        "--rest",
        choices=sorted(KINDS),
        default="pieces",
        help="rest curvature: linear along two pieces of each segment (default), linear or constant"
        " along segments (the nearest, as with --fit)",
    )
    parser.add_argument(
        "--fit", action="store_true", help="find the nearest where the shape cannot be reached"
    )
    parser.add_argument(
        "--tolerance",
        metavar="MM2",
        default=f"{TOLERANCE * 1e6:g}",
        help="sum of squared disk errors that counts as reached (default %(default)s, the paper's)",
    )
    parser.add_argument(
        "--max-curvature", metavar="K", help="largest bending of the rest shape [1/m]"
    )
    parser.add_argument(
        "--steps", metavar="K", default="10", help="in which the pulls are made (default 10)"
    )
    parser.add_argument("-o", "--output", metavar="FILE.yaml", help="write the finger to a file")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--plot", metavar="FILE.png", help="draw it (needs matplotlib)")


def run(args: argparse.Namespace) -> int:
    """Design, verify, write and print; return the exit code."""
    if args.plot:
        checked_path(args.plot)  # before any work is done
    finger = load_finger(find_config(args.finger))
    steps = integer("--steps", args.steps, 1, 1000)
    limit = None
    if args.max_curvature is not None:
        limit = number("--max-curvature", args.max_curvature, 1e-6, 1e9)
    shape = wanted_from_args(args, finger)
    tolerance = number("--tolerance", args.tolerance, 0.0, 1e9) / 1e6
    found: list[Found] = []
    refused: list[str] = []
    for rest, fit, lines in _designs(args, finger, shape, limit):
        refused += lines
        if rest is not None:
            path = pull_from_rest(rest.finger, rest.pulls, shape, steps, tolerance)
            found.append(Found(rest, path, fit))
    best = min(found, key=lambda f: f.rank, default=None)
    if best is not None and args.output:
        write_finger(best.shape.finger, args.output, comment(best, args.curve or args.shape))
    if args.json:
        print(json.dumps(to_dict(finger, shape, found, best, refused)))
    else:
        print_table(finger, shape, found, best, refused)
    if best is not None and args.plot:
        from ccr_ros.viz.design_plot import plot_design

        plot_design(Path(args.plot), best.path.last, shape, rest=best.path.steps[0])
    if best is not None:
        print_files(args)
    return 0 if best is not None and best.path.reached else 1


def _designs(
    args: argparse.Namespace, finger: Finger, shape: DesiredShape, limit: float | None
) -> Iterator[tuple[RestShape | None, BestFit | None, Sequence[str]]]:
    """Yield rest shapes, how they were fitted if so, and why there is none for some pulls."""
    presses = [_press(word) for word in args.press]
    combinations = _pulls(args.pull, finger)
    if args.fit or args.rest != "pieces":
        if presses:
            raise InvalidValue("--press", args.press, "left out of a best fit (--fit, --rest)")
        for pulls in combinations:
            try:
                fit = best_fit(finger, shape, pulls, args.rest, limit)
                yield fit.shape, fit, ()
            except NotConverged as error:
                yield None, None, [str(error)]
        return
    solver = RestShapeSolver(finger)
    for pulls in combinations:
        design = solver.solve(shape, pulls, presses, limit)
        yield None, None, design.refused
        for rest in design.shapes:
            yield rest, None, ()


def _pulls(words: list[str], finger: Finger) -> list[dict[str, Pull]]:
    """Return pulls by cable, one dictionary for each combination of the values given."""
    values: dict[str, list[Pull]] = {}
    for word in words:
        cable, equals, texts = word.partition("=")
        if not equals:
            raise InvalidValue("--pull", word, "CABLE=VALUE, such as main=3% or main=0.0055")
        if cable not in finger.cable_names:
            raise UnknownName("cable", cable, finger.cable_names)
        if cable in values:
            raise InvalidValue(f"--pull {cable}", word, "given once per cable")
        place = f"--pull {cable}"
        values[cable] = [Pull(*parse_pull(place, text)) for text in texts.split(",")]
    if not values:
        raise InvalidValue("--pull", None, "given: CABLE=VALUE, such as main=3% or main=0.0055")
    combinations = list(itertools.islice(itertools.product(*values.values()), _MOST_PULLS + 1))
    if len(combinations) > _MOST_PULLS:
        raise InvalidValue("--pull", words, f"at most {_MOST_PULLS} combinations of values")
    return [dict(zip(values, combination, strict=True)) for combination in combinations]


def _press(word: str) -> Press:
    where, equals, force = word.partition("=")
    disk, colon, point = where.partition(":")
    if not equals or (colon and not point):
        raise InvalidValue("--press", word, "DISK=FORCE or DISK:POINT=FORCE, such as 7:cable=0.2")
    kind, _, cable = point.partition(".")
    index = integer("--press", disk, 1, 1000)
    return Press(index, number("--press", force, 1e-12, 1e12), kind, cable)
