# SPDX-License-Identifier: Apache-2.0
"""Fit bending stiffness, Poisson's ratio and cable stretch to measurements.

DATA is a CSV file, or the name of one in config/ (table_1_loads: the paper's), with a header:
{columns}
An empty cell is not measured. What is not fitted is as the fingers' files say: their own nu, and
cables that do not stretch. Stretch is how much longer a cable becomes per newton [m/N].
Intervals are of 95 %. Exit code: 0 all found, 1 some cannot be told from the data, 2 bad input.

  ccr design fit table_1_loads --only straight --only helical --only 'general_*'
  ccr design fit bench.csv --finger my_finger.yaml --fit EI,nu,stretch --unit mm -o fitted.yaml
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import asdict, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np

from ccr_ros.cli.design.pulls import parse_number
from ccr_ros.design.calibration import PARAMETERS, Calibration, calibrate
from ccr_ros.design.calibration_files import COLUMNS, read_measurements
from ccr_ros.design.calibration_model import Measurement
from ccr_ros.design.curve_files import UNITS
from ccr_ros.model import Finger, InvalidValue
from ccr_ros.model.files import load_finger
from ccr_ros.model.finger_text import write_finger
from ccr_ros.resources import config_dir, find_config

__doc__ = (__doc__ or "").replace("{columns}", COLUMNS)  # for --help

_UNITS = {"EI": "N m2", "nu": "", "stretch": "m/N"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument("data", metavar="DATA", help="CSV file, or the name of one in config/")
    parser.add_argument("--finger", metavar="FINGER", help="of the rows that do not name one")
    parser.add_argument(
        "--fit",
        metavar="NAMES",
        default="EI",
        help=f"what to fit, of {', '.join(PARAMETERS)}, or stretch_CABLE (default EI)",
    )
    parser.add_argument(
        "--only",
        metavar="PATTERN",
        action="append",
        default=[],
        help="only the rows of fingers of such a name (*, ? as in shells); several times",
    )
    parser.add_argument("--stiffness", metavar="EI", help="EI [N m2], where it is known")
    parser.add_argument(
        "--unit", choices=sorted(UNITS), default="m", help="of positions (default m)"
    )
    parser.add_argument(
        "--position-scatter",
        metavar="MM",
        help="standard deviation of a measured coordinate [mm] (default: estimated)",
    )
    parser.add_argument(
        "--load-scatter", metavar="N", help="of a measured load [N] (default: estimated)"
    )
    parser.add_argument("-o", "--output", metavar="FILE.yaml", help="write the fitted finger")
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def run(args: argparse.Namespace) -> int:
    """Fit, print and write; return the exit code."""
    finger = load_finger(find_config(args.finger)) if args.finger else None
    rows = read_measurements(_data(args.data), _load, finger, args.unit)
    if args.only:
        every = sorted({row.finger.name for row in rows})
        rows = [r for r in rows if any(fnmatchcase(r.finger.name, p) for p in args.only)]
        if not rows:
            raise InvalidValue(
                "--only", args.only, f"a pattern that fits one of {', '.join(every)}"
            )
    names = {row.finger.name for row in rows}
    if args.output and len(names) > 1:
        raise InvalidValue("--output", args.output, "given for the rows of one finger only")
    position = _given("--position-scatter", args.position_scatter)
    found = calibrate(
        rows,
        [word.strip() for word in args.fit.split(",")],
        position_scatter=None if position is None else position / 1e3,
        load_scatter=_given("--load-scatter", args.load_scatter),
        stiffness=_given("--stiffness", args.stiffness),
    )
    if args.output:
        write_finger(_fitted(rows[0].finger, found), args.output, _comment(args, rows, found))
    if args.json:
        print(json.dumps(_json(rows, found)))
    else:
        _print_table(rows, found)
        if args.output:
            print(f"\nwritten to {args.output}")
    return 1 if found.unknown else 0


def _data(name: str) -> Path:
    path = Path(name).expanduser()
    known = config_dir() / f"{name.removesuffix('.csv')}.csv"
    return known if not path.exists() and len(path.parts) == 1 and known.is_file() else path


def _load(name: str) -> Finger:
    return load_finger(find_config(name))


def _given(option: str, text: str | None) -> float | None:
    return None if text is None else parse_number(option, text)


def _fitted(finger: Finger, found: Calibration) -> Finger:
    changes: dict[str, Any] = {}
    if "EI" in found.estimates:
        changes["youngs_modulus"] = found.estimates["EI"].value / finger.second_moment
    if "nu" in found.estimates:
        changes["poisson_ratio"] = found.estimates["nu"].value
    return replace(finger, **changes)


def _comment(args: argparse.Namespace, rows: Sequence[Measurement], found: Calibration) -> str:
    values = ", ".join(f"{e.name} = {e.value:.6g}" for e in found.estimates.values())
    return f"By `ccr design fit` from {len(rows)} rows of {Path(args.data).name}: {values}."


def _json(rows: Sequence[Measurement], found: Calibration) -> dict[str, Any]:
    def number(value: float) -> float | None:
        return None if np.isnan(value) else value

    return {
        "estimates": {name: asdict(e) for name, e in found.estimates.items()},
        "unknown": found.unknown,
        "products": found.products,
        "position_scatter": number(found.position_scatter),
        "load_scatter": number(found.load_scatter),
        "residuals": found.residuals.tolist(),
        "stiffness_by_load": [
            {"row": rows[int(i)].label, "finger": rows[int(i)].finger.name, "EI": value}
            for i, value in found.stiffness
        ],
    }


def _print_table(rows: Sequence[Measurement], found: Calibration) -> None:
    loads = sum(len(row.loads) for row in rows)
    positions = sum(len(row.positions) for row in rows)
    print(f"{len(rows)} rows: {loads} loads, {positions} positions\n")
    if found.estimates:
        print(f"  {'parameter':<18}{'value':>12}   95 % interval")
    for name, e in found.estimates.items():
        unit = _UNITS[name.partition("_")[0]]
        bound = "   at the end of its range: the model does not explain the data" * e.at_bound
        print(f"  {name:<18}{e.value:>12.4g}   {e.low:.4g} .. {e.high:.4g} {unit}{bound}")
        if name == "EI" and len({row.finger.second_moment for row in rows}) == 1:
            area = rows[0].finger.second_moment
            low, high = e.low / area / 1e9, e.high / area / 1e9
            print(f"  {'E':<18}{e.value / area / 1e9:>12.4g}   {low:.4g} .. {high:.4g} GPa")
    for name, why in found.unknown.items():
        print(f"  {name}: NOT FOUND: {why}")
    for name, value in found.products.items():
        print(f"  EI x {name} = {value:.4g} m3")
    if not np.isnan(found.position_scatter):
        print(f"\n  positions scatter by {found.position_scatter * 1e3:.3g} mm about the model")
    if not np.isnan(found.load_scatter):
        print(f"\n  loads scatter by {found.load_scatter:.3g} N about the model; each alone gives")
        print(f"  {'row':<10}{'finger':<20}{'EI [N m2]':>12}")
        for i, value in found.stiffness:
            row = rows[int(i)]
            print(f"  {row.label:<10}{row.finger.name:<20}{value:>12.4g}")
        alone = found.stiffness[:, 1]
        if len(alone) > 1:
            print(f"  from {alone.min():.3g} to {alone.max():.3g} N m2")
