# SPDX-License-Identifier: Apache-2.0
"""Find the pose of one finger for given cable pulls.

FINGER is a finger file or the name of one in config/ (helical, contact_cylinder, ...).
A pull is a percentage of the cable's rest length inside the finger, or metres; a negative one
pays cable out. Cables that are not named stay unpulled. Exit code: 0 converged, 1 not, 2 bad input.

  ccr solve helical --pull main=4%
  ccr solve two_cables --pull straight=2% --pull helical=0.004 --json
  ccr solve contact_cylinder --pull main=2% --steps 5 --plot contact.png
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np

from ccr_ros.cli.options import integer
from ccr_ros.model import FingerSolver, InvalidValue, Solution, SolverSettings, UnknownName
from ccr_ros.model.files import load_finger
from ccr_ros.resources import find_config
from ccr_ros.viz.figures import checked_path

_TIME_LIMIT = 10.0  # s per solve; a person at a prompt waits longer than a control loop


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument("finger", metavar="FINGER", help="finger file, or a name in config/")
    parser.add_argument(
        "--pull",
        metavar="CABLE=VALUE",
        action="append",
        default=[],
        help="pull of a cable: main=4%% or main=0.0073 [m]; once per cable",
    )
    parser.add_argument(
        "--steps", metavar="K", default="1", help="pull in K equal steps, and show each"
    )
    parser.add_argument("--arcs", metavar="K", default="1", help="arcs per segment (default 1)")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--plot", metavar="FILE.png", help="draw the pose (needs matplotlib)")


def run(args: argparse.Namespace) -> int:
    """Solve, print and plot; return the exit code."""
    if args.plot:
        checked_path(args.plot)  # before any work is done
    steps, arcs = integer("--steps", args.steps, 1, 10_000), integer("--arcs", args.arcs, 1, 64)
    finger = load_finger(find_config(args.finger))
    solver = FingerSolver(finger, SolverSettings(arcs_per_segment=arcs, time_limit=_TIME_LIMIT))
    named = parse_pulls(args.pull, finger.cable_names, solver.rest_lengths)
    pulls = finger.pulls_array(named)
    path: list[Solution] = []
    for step in range(1, steps + 1):
        path.append(solver.solve(pulls * (step / steps)))
        if not path[-1].certificate.converged:
            break
    last = path[-1]
    if args.json:
        print(json.dumps(_json(last, path if steps > 1 else [])))
    else:
        _print_table(last, path if steps > 1 else [], solver.rest_lengths)
    if args.plot:
        from ccr_ros.viz.plots import plot_solution

        plot_solution(last, Path(args.plot), rest=solver.rest)
        if not args.json:
            print(f"drawn in {args.plot}")
    return 0 if last.certificate.converged else 1


def parse_pulls(
    words: list[str],
    cables: tuple[str, ...],
    rest_lengths: np.ndarray,
    option: str = "--pull",
) -> dict[str, float]:
    """Return pulls [m] by cable from words: ``main=4%`` (of the rest length) or ``main=0.007``.

    Raises:
        InvalidValue: A word is not CABLE=VALUE, a value no finite number, or a cable comes twice.
        UnknownName: A cable that the finger does not have.
    """
    pulls: dict[str, float] = {}
    for word in words:
        cable, equals, text = word.partition("=")
        if not equals:
            raise InvalidValue(option, word, "CABLE=VALUE, such as main=4% or main=0.007")
        if cable not in cables:
            raise UnknownName("cable", cable, cables)
        if cable in pulls:
            raise InvalidValue(f"{option} {cable}", word, "given once per cable")
        value, relative = parse_pull(f"{option} {cable}", text)
        length = float(rest_lengths[cables.index(cable)])
        pulls[cable] = value * length if relative else value
    return pulls


def parse_pull(place: str, text: str) -> tuple[float, bool]:
    """Return the value of ``4%`` (0.04 and True: of the rest length) or ``0.007`` (m, and False).

    Raises:
        InvalidValue: It is neither; the error is located at ``place``.
    """
    percent = text.endswith("%")
    try:
        value = float(text.removesuffix("%"))
    except ValueError:
        value = float("nan")
    if not np.isfinite(value):
        raise InvalidValue(place, text, "a finite number of metres (0.007), or a percentage (4%)")
    return (value / 100 if percent else value), percent


def _json(last: Solution, path: list[Solution]) -> dict[str, Any]:
    result = last.to_dict()
    if path:
        keys = ("pulls", "tensions", "contacts", "energy", "certificate")
        result["steps"] = [
            {"tip": s.backbone[-1].tolist(), **{k: s.to_dict()[k] for k in keys}} for s in path
        ]
    return result


def _print_table(last: Solution, path: list[Solution], rest_lengths: np.ndarray) -> None:
    finger, c = last.finger, last.certificate
    newton = finger.forces_are == "newton"
    unit = "N" if newton else "1/m2 (per EI)"
    print(f"{finger.name}: {finger.length * 1e3:g} mm, {finger.segments} segments\n")
    print(f"  {'cable':<12}{'pull':>10}{'of rest':>9}{'tension':>12} {unit}")
    rows = zip(finger.cables, last.pulls, rest_lengths, last.tensions, strict=True)
    for cable, pull, rest, tension in rows:
        note = "  slack" if tension == 0 else ""
        if cable.last_disk < finger.segments:
            note += f"  (ends at disk {cable.last_disk})"
        print(f"  {cable.name:<12}{pull * 1e3:>7.3f} mm{pull / rest:>9.2%}{tension:>12.4g}{note}")
    if path:
        print(f"\n  {'step':>4}{'tip x':>10}{'y':>9}{'z':>9} mm   tensions [{unit}], contacts")
        for k, s in enumerate(path, 1):
            x, y, z = s.backbone[-1] * 1e3
            tensions = " ".join(f"{t:.4g}" for t in s.tensions)
            touching = ", ".join(f"disk {k.disk} {k.point} {k.force:.3g}" for k in s.contacts)
            print(f"  {k:>4}{x:>10.3f}{y:>9.3f}{z:>9.3f}      {tensions}  {touching}")
    print(f"\n  {'disk':>4}{'x':>10}{'y':>9}{'z':>9} mm")
    for i, (x, y, z) in enumerate(last.backbone * 1e3):
        notes = [
            f"{k.point}{f' of {k.cable}' if k.cable else ''} on {k.obstacle}: {k.force:.4g} {unit}"
            for k in last.contacts
            if k.disk == i
        ]
        print(f"  {i:>4}{x:>10.3f}{y:>9.3f}{z:>9.3f}  {'; '.join(notes)}".rstrip())
    energy = f"{last.energy * 1e3:.4g} mJ" if newton else f"{last.energy:.4g} 1/m (per EI)"
    print(f"\n  strain energy {energy}")
    print(
        f"  {'converged' if c.converged else 'NOT CONVERGED'},"
        f" {'stable' if c.stable else 'NOT STABLE'}"
        f" (smallest eigenvalue {c.smallest_eigenvalue:.3g});"
        f" force residual {c.kkt:.1e}, cable error {c.cable_error * 1e3:.1e} mm,"
        f" penetration {c.penetration * 1e3:.1e} mm"
    )
    print(f"  {c.iterations} iterations in {c.substeps} steps, {c.solve_time * 1e3:.2f} ms")
    if c.message:
        print(f"  {c.message}")
