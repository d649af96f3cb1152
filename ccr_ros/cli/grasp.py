# SPDX-License-Identifier: Apache-2.0
"""Close a gripper on an object, let the object go, and see how it is held.

GRIPPER is a gripper file or the name of one in config/ (gripper_sphere). OBJECT is
sphere:DIAMETER, cylinder:DIAMETERxHEIGHT, box:LENGTHxWIDTHxHEIGHT, or mesh:FILE.stl (convex, in
millimetres), upright, its centre --center-height above the plane of the fingers' bases. It stands
on its support while the fingers close; then the support goes, and fingers and object find their
equilibrium, with friction. Without --disks nothing keeps fingers from passing through each other:
where they do the object does not count as held, and the disks are named. Lengths in m. Exit code: 0
the object is held, 1 it is not, 2 bad input.

  ccr grasp gripper_sphere --object sphere:0.112 --center-height 0.110 --mass 0.02 --friction 0.5 \\
      --pull 3.2%
  ccr grasp gripper_sphere --object sphere:0.112 --center-height 0.110 --mass 0.02 --friction 0.5 \\
      --pull 3.2% --pull finger_1.main=3.4% --points down --until-slip
"""

from __future__ import annotations

import argparse
import json

import numpy as np

from ccr_ros.cli.grasp_arguments import add_body_arguments, body_from_args, gravity_from_args
from ccr_ros.cli.grasp_report import Findings, report, to_dict
from ccr_ros.cli.options import number
from ccr_ros.cli.solve import parse_pull
from ccr_ros.grasp.clearance import disk_clearance
from ccr_ros.grasp.quality import compliance_of, payload_until_slip, quality_of
from ccr_ros.grasp.statics import DiskShape, GraspSolver
from ccr_ros.model import InvalidValue, SolverSettings, UnknownName, load_gripper
from ccr_ros.resources import find_config

_TIME_LIMIT = 60.0  # s per solve; a person at a prompt waits longer than a control loop


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    add_body_arguments(parser)
    parser.add_argument(
        "--pull",
        metavar="[[FINGER.]CABLE=]VALUE",
        action="append",
        help="3.2%% of the cable's rest length, or 0.0058 [m]: of every cable, of this cable of all"
        " fingers, or of one; later ones count",
        required=True,
    )
    parser.add_argument(
        "--until-slip",
        action="store_true",
        help="also the weight at which contacts slip and at which it is lost (takes longer)",
    )
    parser.add_argument(
        "--disks",
        metavar="RIM",
        nargs="?",
        const="0",
        help="disks of different fingers press on each other instead of going through each other;"
        " RIM is how far they reach beyond their holes [m] (default 0)",
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def run(args: argparse.Namespace) -> int:
    """Grasp and print; return the exit code."""
    body = body_from_args(args)
    gripper = load_gripper(find_config(args.gripper))
    gravity = gravity_from_args(args)
    disks = None if args.disks is None else DiskShape(rim=number("--disks", args.disks, 0, 1))
    settings = SolverSettings(time_limit=_TIME_LIMIT)
    solver = GraspSolver(gripper.fingers, body, settings, gravity, disks=disks)
    solution = solver.solve(parse_grip(args.pull, solver))
    if solution.converged:
        solution = solver.let_go()
    clearance = disk_clearance(solution.fingers, [m.base for m in gripper.fingers])
    held = solution.converged and solution.stable and not solution.supported
    through = disks is None and clearance.touching
    held = held and not through
    quality = compliance = loads = None
    if solution.converged and solution.contacts:
        quality = quality_of(solution, gravity=gravity)
    if held:
        compliance = compliance_of(solver)
        if args.until_slip:
            loads = payload_until_slip(solver)
    findings = Findings(
        gripper.name, solution, held, clearance, through, quality, compliance, loads
    )
    print(json.dumps(to_dict(findings)) if args.json else report(findings))
    return 0 if held else 1


def parse_grip(words: list[str], solver: GraspSolver) -> dict[str, np.ndarray]:
    """Return pulls [m] of each finger's cables from words such as ``3.2%``, ``finger_1.main=3%``.

    Raises:
        InvalidValue: A word is none of these, or VALUE alone where a finger has several cables.
        UnknownName: A finger or a cable that is not there.
    """
    pulls = {m.finger.name: np.zeros(len(m.finger.cables)) for m in solver.hand.mounted}
    for word in words:
        names, equals, text = word.rpartition("=")
        value, relative = parse_pull("--pull", text)
        finger, dot, cable = names.rpartition(".")
        if dot and finger not in pulls:
            raise UnknownName("finger", finger, pulls)
        found = False
        for mounted, problem in zip(solver.hand.mounted, solver.hand.problems, strict=True):
            own = mounted.finger
            if dot and own.name != finger:
                continue
            if not equals and len(own.cables) > 1:
                allowed = f"CABLE={word}, CABLE one of {', '.join(own.cable_names)}"
                raise InvalidValue("--pull", word, allowed)
            for index, name in enumerate(own.cable_names):
                if equals and name != cable:
                    continue
                rest = float(problem.rest_lengths[index]) * own.length
                pulls[own.name][index] = value * rest if relative else value
                found = True
        if not found:
            cables = [
                name
                for m in solver.hand.mounted
                if m.finger.name == finger or not dot
                for name in m.finger.cable_names
            ]
            raise UnknownName("cable", cable, dict.fromkeys(cables))
    return pulls
