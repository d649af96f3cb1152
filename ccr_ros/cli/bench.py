# SPDX-License-Identifier: Apache-2.0
"""Measure speed, accuracy and memory next to general solvers on the literature's formulation.

Every figure is measured in this run, single-threaded, and stands as a ratio to a baseline of the
same run. The full set takes some minutes. Exit code 0: this project's solver converged everywhere.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import subprocess
import sys
from pathlib import Path

from ccr_ros.model.errors import CcrError

CHECKOUT = Path(__file__).resolve().parents[2]

# Before NumPy loads its BLAS, so the rows run in a process of their own.
SINGLE_THREADED = {
    name: "1"
    for name in (
        "OMP_NUM_THREADS",
        "OPENBLAS_NUM_THREADS",
        "MKL_NUM_THREADS",
        "VECLIB_MAXIMUM_THREADS",
    )
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("--quick", action="store_true", help="a few rows in under a minute")
    parser.add_argument("--json", action="store_true", help="print one JSON object, no table")
    parser.add_argument(
        "--rows",
        metavar="PATTERN",
        help="only rows whose name group/case/nN/solver matches, e.g. 'sweep/straight/n9/*'",
    )


def run(args: argparse.Namespace) -> int:
    """Run the benchmarks in a process of their own and return its exit code.

    Raises:
        CcrError: There is no ``benchmarks`` folder, or no SciPy, here.
    """
    if not (CHECKOUT / "benchmarks" / "__main__.py").is_file():
        raise CcrError(
            "bench runs from a checkout of the repository; an installed package has no benchmarks"
        )
    if importlib.util.find_spec("scipy") is None:
        raise CcrError("bench needs SciPy; pip install 'scipy>=1.11,<2'")
    command = [sys.executable, "-m", "benchmarks"]
    command += ["--quick"] * args.quick + ["--json"] * args.json
    command += ["--rows", args.rows] if args.rows else []
    path = os.pathsep.join(filter(None, [str(CHECKOUT), os.environ.get("PYTHONPATH")]))
    environment = {**os.environ, **SINGLE_THREADED, "PYTHONPATH": path}
    return subprocess.run(command, env=environment, check=False).returncode
