# SPDX-License-Identifier: Apache-2.0
"""The rows as a table for people."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from .measure import Row
from .suites import GROUPS

Column = tuple[str, Callable[[Row], str]]


def _number(value: float | None, pattern: str) -> str:
    return "-" if value is None else format(value, pattern)


def _times(value: float | None) -> str:
    """A ratio with three digits that matter, e.g. 0.0123x or 124x."""
    if value is None:
        return "-"
    return f"{value:.0f}x" if value >= 100 else f"{value:#.3g}x"


def _error(row: Row) -> str:
    mark = "*" if row.rms_against == "ccr_ros" else ""
    return _number(row.rms_mm, ".5f") + mark


TIMED: tuple[Column, ...] = (
    ("solver", lambda r: r.name),
    ("p50 ms", lambda r: _number(r.p50_ms, ".2f")),
    ("p99 ms", lambda r: _number(r.p99_ms, ".2f")),
    ("cpu ms", lambda r: _number(r.cpu_ms, ".2f")),
    ("p50 ratio", lambda r: _times(r.ratio)),
    ("cpu ratio", lambda r: _times(r.cpu_ratio)),
    ("RMS mm", _error),
    ("RMS %", lambda r: _number(r.rms_percent, ".5f")),
    ("RMS ratio", lambda r: _times(r.rms_ratio)),
    ("iter.", lambda r: _number(r.iterations, ".0f")),
    ("build ms", lambda r: _number(r.build_ms, ".0f")),
    ("note", lambda r: r.note),
)
MEMORY: tuple[Column, ...] = (
    ("solver", lambda r: r.name),
    ("memory MB", lambda r: _number(r.memory_mb, ".1f")),
    ("ratio", lambda r: _times(r.ratio)),
    ("note", lambda r: r.note),
)
SENT: tuple[Column, ...] = (
    ("carrier", lambda r: r.name),
    ("p50 ms", lambda r: _number(r.p50_ms, ".3f")),
    ("p99 ms", lambda r: _number(r.p99_ms, ".3f")),
    ("cpu ms", lambda r: _number(r.cpu_ms, ".3f")),
    ("p50 ratio", lambda r: _times(r.ratio)),
    ("cpu ratio", lambda r: _times(r.cpu_ratio)),
    ("note", lambda r: r.note),
)
HELD = tuple(column for column in TIMED if not column[0].startswith("RMS"))
COLUMNS = {"memory": MEMORY, "transport": SENT, "grasp": HELD}
TEXT = {"solver", "carrier", "note"}  # left-aligned


def table(rows: Sequence[Row]) -> str:
    """Return all rows as text, by group, then by case and number of segments."""
    parts = []
    for group, title in GROUPS.items():
        members = [row for row in rows if row.group == group]
        if members:
            baselines = " or ".join(dict.fromkeys(f"{row.baseline!r}" for row in members))
            parts.append(f"{title}\n{'=' * len(title)}\nratios are to {baselines}\n")
            parts.append(_group(members, COLUMNS.get(group, TIMED)))
    parts.append(
        "Lower is better in every column. p50, p99: wall time of one warm step, single-threaded;\n"
        "cpu: median CPU time of a step, which other programs on the machine disturb less.\n"
        "RMS: over disk centres at the end of the sweep, against the independent reference rod\n"
        "(% of the finger's length); with *, against ccr_ros: the reference has other disks.\n"
        "iter.: median per step.\n"
        "pulls: a step is a point of the path, iter. how many poses are tried for it, and what\n"
        "the tip is off by is a root mean square over the path.\n"
        "rest-shape: a step is one whole design, iter. its forward solves; RMS is of the forward\n"
        "model against the wanted disks.\n"
        "routing: a step is a whole search, iter. how many poses are tried by the forward solver;\n"
        "found: every disk within 0.1 mm of the wanted centre.\n"
        "grasp: the rows of ball with friction are compared with IPOPT without; iter. of Newton.\n"
        "transport: p50, p99 from publish to callback, or of calling a service until its answer;\n"
        "cpu of both processes for one of them, or of an idle node in a second."
    )
    return "\n".join(parts)


def _group(rows: Sequence[Row], columns: Sequence[Column]) -> str:
    cells = [[text(row) for _, text in columns] for row in rows]
    heads = [head for head, _ in columns]
    widths = [max(len(c) for c in column) for column in zip(heads, *cells, strict=True)]

    def line(values: Sequence[str]) -> str:
        aligned = (
            value.ljust(width) if head in TEXT else value.rjust(width)
            for value, width, head in zip(values, widths, heads, strict=True)
        )
        return "  " + "  ".join(aligned).rstrip()

    lines = [line(heads)]
    last = None
    for row, values in zip(rows, cells, strict=True):
        if (row.case, row.n) != last:
            last = (row.case, row.n)
            lines.append(f"{row.case}, n = {row.n}{', contact' if row.contact else ''}")
        lines.append(line(values))
    return "\n".join(lines) + "\n"
