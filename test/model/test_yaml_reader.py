# SPDX-License-Identifier: Apache-2.0
"""Texts that are not what a finger file should be, down to bytes that are no text."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ccr_ros.model import CcrError, InvalidFile, InvalidValue, load_finger
from ccr_ros.model.errors import UnknownKey

TEXT = """\
name: small
length: 0.1
segments: 2
disk_radius: 0.008
backbone_diameter: 0.0025
poisson_ratio: 0.39
cables:
  - {name: main, holes: [1, 2, 12]}
"""


@pytest.fixture
def write(tmp_path):
    """Return a function that writes a file and returns its path."""

    def write(content, name="finger.yaml"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "is empty"),
        (b"# only a remark\n", "is empty"),
        (b"- 1\n- 2\n", "holds a list"),
        (b"straight\n", "holds a single value"),
        (b"\x89PNG\r\n\x1a\n\x00", "not UTF-8 text (line 1)"),
        (b"# x\nname: \xe9\n", "not UTF-8 text (line 2)"),
        (TEXT.encode("utf-16"), "not UTF-8"),
        (b"name: a\nlength: \x00\n", "line 2: character #x0000"),
        (TEXT + "\tnu: 1\n", "line 9, column 1: found a tab"),
        (TEXT + "length: 0.2\n", "line 9, column 1: the key 'length' is given twice"),
        (TEXT.replace("{name", "{name: x, name"), "line 8, column 15: the key 'name' is given"),
        (TEXT + "a: [1, 2\n", "line 10, column 1: expected ',' or ']'"),
        (TEXT + "a: *b\n", "line 9, column 4: found undefined alias 'b'"),
        (TEXT + "---\n" + TEXT, "line 9, column 1: but found another document"),
        ("? [1, 2]\n: 3\n", "found unhashable key"),
        ("a: " + "[" * 5000 + "]" * 5000, "line 1, column 35: nested too deeply"),
        ("a: !!python/object/apply:os.getcwd []\n", "could not determine a constructor"),
        ("a: !!int x\n", "line 1, column 4: not a valid value"),
        ("a: !!bool x\n", "line 1, column 4: not a valid value"),
        ("a: !!timestamp x\n", "line 1, column 4: not a valid value"),
        ("a: " + "9" * 5000, "line 1, column 4: not a valid value"),
        (b"# " + b"x" * 2_000_000, "larger than 2 MB"),
    ],
)
def test_what_is_no_mapping_in_yaml_is_said_in_one_line(write, content, reason):
    path = write(content)
    with pytest.raises(InvalidFile) as caught:
        load_finger(path)
    assert reason in caught.value.reason
    assert caught.value.path == str(path)
    assert str(caught.value) == f"{path}: {caught.value.reason}"
    assert "\n" not in str(caught.value)


def test_unreadable_paths(tmp_path, write):
    inside_a_file = write(TEXT) / "x"
    for path, reason in (
        (tmp_path / "absent.yaml", "No such file or directory"),
        (tmp_path, "Is a directory"),
        (inside_a_file, "Not a directory"),
        ("a\0b", "null byte"),
        ("x" * 5000, "name too long"),
    ):
        with pytest.raises(InvalidFile, match=f"cannot be read: .*{reason}") as caught:
            load_finger(path)
        assert caught.value.path == str(path)


def test_a_byte_order_mark_and_windows_line_ends_do_no_harm(write):
    assert load_finger(write("\ufeff" + TEXT.replace("\n", "\r\n"))).name == "small"


def test_scalars_are_read_as_yaml_1_2_reads_them(write):
    # YAML 1.1 has 2.8e9 as a text, `on` as true and 010 as eight.
    finger = load_finger(write(TEXT.replace("small", "on") + "youngs_modulus: 2.8e9\n"))
    assert finger.name == "on" and finger.youngs_modulus == 2.8e9
    assert load_finger(write(TEXT + "youngs_modulus: 28E+8\n")).youngs_modulus == 2.8e9
    for written in ("010", "1:30", "1_0", "0x2"):
        with pytest.raises(InvalidValue) as caught:
            load_finger(write(TEXT.replace("segments: 2", f"segments: {written}")))
        assert (caught.value.place, caught.value.value) == ("segments", written)


def test_merge_keys_may_be_overridden(write):
    text = TEXT.replace("{name: main", "&m {name: main") + "  - {<<: *m, name: other}\n"
    finger = load_finger(write(text))
    assert finger.cable_names == ("main", "other")
    np.testing.assert_array_equal(*(c.angles for c in finger.cables))


def test_an_alias_bomb_is_refused_without_writing_it_out(write):
    lines = ["rest_curvature:", "  - &a0 [0, 0, 0, 0, 0, 0, 0, 0, 0, 0]"]
    lines += [f"  - &a{k} [{', '.join([f'*a{k - 1}'] * 10)}]" for k in range(1, 30)]
    with pytest.raises(InvalidValue) as caught:
        load_finger(write(TEXT + "\n".join(lines) + "\n"))
    assert caught.value.place == "rest_curvature"
    assert len(str(caught.value)) < 500


def test_merges_of_merges_do_not_multiply(write):
    lines = ["a0: &a0 {x: 1}"]
    lines += [f"a{k}: &a{k} {{<<: [{', '.join([f'*a{k - 1}'] * 10)}]}}" for k in range(1, 30)]
    with pytest.raises(UnknownKey) as caught:
        load_finger(write("\n".join(lines) + "\n"))
    assert (caught.value.place, caught.value.value) == ("a0", {"x": 1})


def test_a_list_that_holds_itself_is_refused(write):
    text = TEXT.partition("cables")[0] + "cables: &c [*c]\n"
    with pytest.raises(InvalidValue, match=r"cables\[0\]: .* must be a mapping"):
        load_finger(write(text))


@settings(derandomize=True, max_examples=80, deadline=None)
@given(data=st.data())
def test_damaged_files_are_refused_in_one_line(data, tmp_path_factory):
    text = bytearray(TEXT.encode())
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(text) - 1))
        text[at : at + data.draw(st.integers(0, 3))] = data.draw(st.binary(max_size=3))
    path = tmp_path_factory.getbasetemp() / "damaged.yaml"
    path.write_bytes(bytes(text))
    try:
        load_finger(path)
    except CcrError as error:
        assert "\n" not in str(error) and str(error).startswith(str(path))
