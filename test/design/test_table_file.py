# SPDX-License-Identifier: Apache-2.0
"""Tables of numbers from CSV files: what is read, and what is refused on which line."""

from __future__ import annotations

import pytest

from ccr_ros.design.table_file import read_table
from ccr_ros.model import InvalidFile


def table(tmp_path, text, columns=None):
    path = tmp_path / "t.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_table(path, columns)


def test_numbers_header_comments_and_blank_lines(tmp_path):
    read = table(
        tmp_path, '\ufeff# made by hand\n\nx, y ,"z"\n1, 2,3\r\n\n# more\n -4e-1 ,+5,.6\n', 3
    )
    assert read.values.tolist() == [[1, 2, 3], [-0.4, 5, 0.6]]
    assert read.lines.tolist() == [4, 7]
    assert read.header == ("x", "y", "z")
    assert table(tmp_path, "1,2\n3,4").header == ()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "holds no numbers"),
        ("x,y,z\n", "holds no numbers"),
        ("1,2,3\n4,5\n", "line 2: 2 values, '4, 5'; 3 between commas are wanted"),
        ("x,y\n1,2,3\n", "line 1: 2 values, 'x, y'; 3"),
        ("1;2;3\n", "line 1: 1 values, '1;2;3'; 3 between commas"),
        ("1,2,3\n\n4,five,6\n", "line 3, column 2: 'five' is no finite number"),
        ("1,2,x\n", "line 1, column 3: 'x' is no finite number"),
        ("1,2,nan\n", "line 1, column 3: 'nan' is no finite number"),
        ("1,-inf,3\n", "line 1, column 2: '-inf' is no finite number"),
        ("1,,3\n", "line 1, column 2: '' is no finite number"),
        ('1,2,"3\n', "line 1: not valid CSV"),
        ("x,y,z\na,b,c\n", "line 2, column 1: 'a' is no finite number"),
        (b"1,2,\xff\n", "not UTF-8 text (line 1)"),
    ],
)
def test_refused(tmp_path, text, words):
    with pytest.raises(InvalidFile) as caught:
        table(tmp_path, text, 3)
    assert words in str(caught.value) and "t.csv" in str(caught.value)


def test_columns_are_as_many_as_in_the_first_line(tmp_path):
    with pytest.raises(InvalidFile, match=r"line 3: 3 values.*; 2 between commas"):
        table(tmp_path, "a,b\n1,2\n1,2,3\n")


def test_no_such_file(tmp_path):
    with pytest.raises(InvalidFile, match="cannot be read"):
        read_table(tmp_path / "none.csv")
