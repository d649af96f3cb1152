# SPDX-License-Identifier: Apache-2.0
"""Reads a table of numbers from a CSV file; what is wrong is said with its line and value."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..model.errors import InvalidFile
from ..model.yaml_reader import read_text

_LARGEST = 20_000_000  # bytes


@dataclass(frozen=True, eq=False)
class Table:
    """A table of numbers.

    Attributes:
        values: (k, c) the numbers.
        lines: (k,) line of the file that each row stands on, from 1.
        header: The columns' names; empty if the file has no header.
    """

    values: np.ndarray
    lines: np.ndarray
    header: tuple[str, ...]


def read_table(path: str | Path, columns: int | None = None) -> Table:
    """Read a CSV file: numbers between commas, lines that begin with ``#`` and empty ones apart.

    The first line may be a header: a line none of whose cells is a number.

    Args:
        path: The file, UTF-8.
        columns: How many numbers a line must have; ``None``: as many as the first has.

    Raises:
        InvalidFile: It cannot be read, holds no numbers, or a line is malformed: says which line
            and which value.
    """
    text = read_text(path, _LARGEST)
    header: tuple[str, ...] = ()
    rows: list[list[float]] = []
    lines: list[int] = []
    reader = csv.reader(text.splitlines(), strict=True, skipinitialspace=True)
    try:
        for cells in reader:
            cells = [cell.strip() for cell in cells]
            if not any(cells) or cells[0].startswith("#"):
                continue
            line = reader.line_num
            if not rows and not header and not any(_is_number(cell) for cell in cells):
                header = tuple(cells)
            else:
                rows.append([_number(path, line, i, cell) for i, cell in enumerate(cells, 1)])
                lines.append(line)
            columns = columns or len(cells)
            if len(cells) != columns:
                found = f"line {line}: {len(cells)} values, {', '.join(cells)[:60]!r}"
                raise InvalidFile(path, f"{found}; {columns} between commas are wanted")
    except csv.Error as error:
        raise InvalidFile(path, f"line {reader.line_num}: not valid CSV: {error}") from None
    if not rows:
        raise InvalidFile(path, "holds no numbers; lines of numbers between commas are wanted")
    return Table(np.array(rows), np.array(lines), header)


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _number(path: str | Path, line: int, column: int, cell: str) -> float:
    value = float(cell) if _is_number(cell) else math.nan
    if not math.isfinite(value):
        raise InvalidFile(path, f"line {line}, column {column}: {cell[:40]!r} is no finite number")
    return value
