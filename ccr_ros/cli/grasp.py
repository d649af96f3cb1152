# SPDX-License-Identifier: Apache-2.0
"""Close a gripper on an object, let the object go, and see how it is held.

GRIPPER is a gripper file or the name of one in config/ (gripper_sphere). OBJECT is
sphere:DIAMETER, cylinder:DIAMETERxHEIGHT, box:LENGTHxWIDTHxHEIGHT, or mesh:FILE.stl (convex, in
millimetres), upright, its centre --center-height above the plane of the fingers' bases. It stands
on its support while the fingers close; then the support goes, and fingers and object find their
equilibrium, with friction. Lengths in m. Exit code: 0 the object is held, 1 it is not, 2 bad input.

  ccr grasp gripper_sphere --object sphere:0.112 --center-height 0.110 --mass 0.02 --friction 0.5 \\
      --pull 3.2%
  ccr grasp gripper_sphere --object sphere:0.112 --center-height 0.110 --mass 0.02 --friction 0.5 \\
      --pull 3.2% --pull finger_1.main=3.4% --points down --until-slip
"""

from __future__ import annotations

import argparse
import json
from typing import Any

import numpy as np

from ccr_ros.cli.grasp_report import Findings, report, to_dict
from ccr_ros.cli.options import number
from ccr_ros.cli.solve import parse_pull
from ccr_ros.design.curve_text import object_from_text
from ccr_ros.grasp.quality import compliance_of, payload_until_slip, quality_of
from ccr_ros.grasp.statics import (
    Body,
    GraspSolver,
    box_body,
    cylinder_body,
    mesh_body,
    sphere_body,
)
from ccr_ros.model import ConvexMesh, InvalidValue, Pose, SolverSettings, UnknownName, load_gripper
from ccr_ros.resources import find_config

_TIME_LIMIT = 60.0  # s per solve; a person at a prompt waits longer than a control loop
_STANDARD = 9.80665
_DOWN = {  # gravity in the frame of a gripper that points so
    "up": np.array([0.0, 0.0, -_STANDARD]),
    "down": np.array([0.0, 0.0, _STANDARD]),
    "sideways": np.array([-_STANDARD, 0.0, 0.0]),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    need: Any = {"required": True}
    parser.add_argument("gripper", metavar="GRIPPER", help="gripper file, or a name in config/")
    parser.add_argument("--object", metavar="OBJECT", help="such as sphere:0.112", **need)
    parser.add_argument(
        "--center-height", metavar="M", help="of its centre above the bases [m]", **need
    )
    parser.add_argument("--mass", metavar="KG", default="0", help="of the object (default 0)")
    parser.add_argument(
        "--friction", metavar="MU", default="0", help="between it and the fingers (default 0)"
    )
    parser.add_argument(
        "--pull",
        metavar="[[FINGER.]CABLE=]VALUE",
        action="append",
        help="3.2%% of the cable's rest length, or 0.0058 [m]: of every cable, of this cable of all"
        " fingers, or of one; later ones count",
        **need,
    )
    parser.add_argument(
        "--points",
        choices=_DOWN,
        default="up",
        help="where the gripper points (default up); sideways: gravity is along its -x",
    )
    parser.add_argument(
        "--until-slip",
        action="store_true",
        help="also the weight at which contacts slip and at which it is lost (takes longer)",
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def run(args: argparse.Namespace) -> int:
    """Grasp and print; return the exit code."""
    body = body_from_text(
        args.object,
        Pose(np.array([0.0, 0.0, number("--center-height", args.center_height, -10, 10)])),
        number("--mass", args.mass, 0, 1e3),
        number("--friction", args.friction, 0, 100),
    )
    gripper = load_gripper(find_config(args.gripper))
    gravity = _DOWN[args.points]
    solver = GraspSolver(gripper.fingers, body, SolverSettings(time_limit=_TIME_LIMIT), gravity)
    solution = solver.solve(parse_grip(args.pull, solver))
    if solution.converged:
        solution = solver.let_go()
    held = solution.converged and solution.stable and not solution.supported
    quality = compliance = loads = None
    if solution.converged and solution.contacts:
        quality = quality_of(solution, gravity=gravity)
    if held:
        compliance = compliance_of(solver)
        if args.until_slip:
            loads = payload_until_slip(solver)
    findings = Findings(gripper.name, solution, held, quality, compliance, loads)
    print(json.dumps(to_dict(findings)) if args.json else report(findings))
    return 0 if held else 1


def body_from_text(text: str, pose: Pose, mass: float, friction: float) -> Body:
    """Return the body that a text names: see this module's help.

    Raises:
        InvalidValue, UnknownName: It is none.
        InvalidFile, MissingPackage: A mesh cannot be read.
    """
    if text.startswith("mesh:"):
        mesh = ConvexMesh.from_stl(text.removeprefix("mesh:"), 1e-3)
        return mesh_body(mesh, mass, pose, friction)
    sized = object_from_text(text)
    if sized.kind == "sphere":
        return sphere_body(sized.size[0], mass, pose, friction)
    if sized.kind == "cylinder":
        diameter, height = sized.size
        return cylinder_body(diameter, height, mass, pose, friction)
    return box_body(np.array(sized.size), mass, pose, friction)


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
