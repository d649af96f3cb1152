# SPDX-License-Identifier: Apache-2.0
"""``python -m benchmarks``: run the rows and print them; ``ccr bench`` starts this."""

from __future__ import annotations

import argparse
import json
import os
import platform
import sys
import time
from collections.abc import Sequence
from fnmatch import fnmatchcase
from importlib.metadata import version

from .grasping import grasps, measure_grasp
from .measure import OWN, Row, measure, set_error
from .memory import measure_memory
from .routing import measure_search, searches
from .suites import memory_plans, plans
from .table import table
from .tracking import measure_track, tracks
from .transport import connections, measure_connection


def main(argv: Sequence[str] | None = None) -> int:
    """Run; return 0, 1 if this project's solver did not converge somewhere, 2 if no row matches."""
    parser = argparse.ArgumentParser(prog="benchmarks", description=__doc__)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--rows", default="*", metavar="PATTERN")
    args = parser.parse_args(argv)
    begin = time.perf_counter()
    rows = run(args.quick, args.rows)
    if not rows:
        print(f"no row matches {args.rows!r}; rows are group/case/nN/solver", file=sys.stderr)
        return 2
    seconds = time.perf_counter() - begin
    if args.json:
        print(json.dumps(report(rows, args.quick, seconds), indent=1))
    else:
        print(table(rows))
        print(f"\n{len(rows)} rows in {seconds:.0f} s; {_machine()}")
    # Not the group "cable-model": with given spans a finger may have no pose clear of an obstacle.
    groups = ("sweep", "pulls", "rest-shape", "routing", "grasp")
    ours = (
        r
        for r in rows
        if r.group == "discretisation" or (r.group in groups and r.name.startswith(OWN))
    )
    return int(any(row.converged < row.samples for row in ours))


def run(quick: bool, pattern: str = "*") -> list[Row]:
    """Measure the rows whose id (group/case/nN/solver) matches the shell pattern, or has it inside.

    Progress goes to standard error.
    """

    def wanted(row_id: str) -> bool:
        return fnmatchcase(row_id, pattern) or fnmatchcase(row_id, f"*{pattern}*")

    timed = [plan for plan in plans(quick) if wanted(plan.id)]
    memory = [
        row
        for method, case, n in memory_plans(quick)
        if wanted(
            (
                row := Row(
                    "memory", method, case, n, False, "ipopt", f"memory/{case}/n{n}/{method}"
                )
            ).id
        )
    ]
    sent = [row for plan in connections(quick) if wanted((row := plan.row()).id)]
    tracked = [row for plan in tracks(quick) if wanted((row := plan.row()).id)]
    searched = [row for plan in searches(quick) if wanted((row := plan.row()).id)]
    held = [row for plan in grasps(quick) if wanted((row := plan.row()).id)]
    total = sum(map(len, (timed, memory, sent, tracked, searched, held)))
    rows: list[Row] = []
    for plan in timed:
        _progress(len(rows), total, plan.id)
        rows.append(measure(plan))
        if plan.case.truth is None:
            _compare_with_own(rows, plan.case.finger.length)
    for row in memory:
        _progress(len(rows), total, row.id)
        row.memory_mb = measure_memory(row.name, row.case, row.n)
        rows.append(row)
    for row in tracked:
        _progress(len(rows), total, row.id)
        measure_track(row, quick)
        rows.append(row)
    for row in searched:
        _progress(len(rows), total, row.id)
        measure_search(row, quick)
        rows.append(row)
    for row in held:
        _progress(len(rows), total, row.id)
        measure_grasp(row, quick)
        rows.append(row)
    for row in sent:
        _progress(len(rows), total, row.id)
        measure_connection(row, quick)
        rows.append(row)
    _progress(len(rows), total, "done")
    _set_ratios(rows)
    return rows


def _compare_with_own(rows: list[Row], length: float) -> None:
    """Where there is no reference, compare the last row with this project's solver in this run."""
    last = rows[-1]
    for row in rows[:-1]:
        same = (row.group, row.case, row.n) == (last.group, last.case, last.n)
        if same and row.name == OWN and row.backbone is not None and last.backbone is not None:
            set_error(last, last.backbone, row.backbone, length, OWN)


def _set_ratios(rows: list[Row]) -> None:
    by_name = {(row.group, row.case, row.n, row.name): row for row in rows}
    for row in rows:
        other = by_name.get((row.group, row.case, row.n, row.baseline))
        if other is None:
            continue
        row.ratio = _ratio(row.memory_mb, other.memory_mb) or _ratio(row.p50_ms, other.p50_ms)
        row.cpu_ratio = _ratio(row.cpu_ms, other.cpu_ms)
        if row.rms_against == other.rms_against:
            row.rms_ratio = _ratio(row.rms_mm, other.rms_mm)


def _ratio(value: float | None, baseline: float | None) -> float | None:
    return value / baseline if value is not None and baseline else None


def _progress(done: int, total: int, text: str) -> None:
    if sys.stderr.isatty():
        print(f"\r\033[K{done}/{total} {text}", end="\n" if done == total else "", file=sys.stderr)
        sys.stderr.flush()


def _machine() -> str:
    return (
        f"Python {platform.python_version()}, NumPy {version('numpy')}, SciPy {version('scipy')}, "
        f"CasADi {version('casadi')}, {os.cpu_count()} CPUs, {platform.machine()}"
    )


def report(rows: list[Row], quick: bool, seconds: float) -> dict[str, object]:
    """Return the one object of ``--json``."""
    return {
        "mode": "quick" if quick else "full",
        "seconds": seconds,
        "threads": os.environ.get("OMP_NUM_THREADS", "default"),
        "machine": _machine(),
        "rows": [row.as_dict() for row in rows],
    }


if __name__ == "__main__":
    try:
        code = main()
        sys.stdout.flush()  # so that a broken pipe is met here, not while exiting
    except BrokenPipeError:
        # Whoever read our output has gone (as `| head` does): nothing is left to say.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 0
    sys.exit(code)
