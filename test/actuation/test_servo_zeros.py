# SPDX-License-Identifier: Apache-2.0
"""The file of zeros: there and back, never half, and clear about what is wrong with it."""

import math
import os

import pytest
from hypothesis import given
from hypothesis import strategies as st
from racks import rack

from ccr_ros.actuation import zeros as module
from ccr_ros.actuation.zeros import load_zeros, save_zeros
from ccr_ros.model import InvalidFile, InvalidValue

PAIR = rack()


@given(st.dictionaries(st.sampled_from(PAIR.names), st.floats(-1e5, 1e5)))
def test_there_and_back(tmp_path_factory, zeros):
    path = tmp_path_factory.mktemp("zeros") / "new" / "folder" / "zeros.yaml"
    assert load_zeros(path, PAIR, "loopback") == {}
    save_zeros(path, PAIR, "loopback", zeros)
    assert load_zeros(path, PAIR, "loopback") == zeros
    assert os.listdir(path.parent) == ["zeros.yaml"]


@pytest.mark.parametrize("moment", ["write", "fsync", "replace"])
def test_a_power_cut_leaves_the_old_zeros(tmp_path, monkeypatch, moment):
    path = tmp_path / "zeros.yaml"
    old, new = {"thumb_main": 1.0, "index_main": 2.0}, {"thumb_main": 3.0, "index_main": 4.0}
    save_zeros(path, PAIR, "loopback", old)

    class PowerCut(BaseException):
        pass

    def cut(*_, **__):
        raise PowerCut

    with monkeypatch.context() as patch:
        if moment == "fsync":
            patch.setattr(module.os, "fsync", cut)
        elif moment == "replace":
            patch.setattr(module.Path, "replace", cut)
        else:
            dump = module.yaml.safe_dump
            patch.setattr(module.yaml, "safe_dump", lambda *a, **k: dump(*a, **k)[:20])
            patch.setattr(module.os, "fsync", cut)
        with pytest.raises(PowerCut):
            save_zeros(path, PAIR, "loopback", new)
    assert load_zeros(path, PAIR, "loopback") == old
    save_zeros(path, PAIR, "loopback", new)  # whatever was left behind is in nobody's way
    assert load_zeros(path, PAIR, "loopback") == new
    assert os.listdir(tmp_path) == ["zeros.yaml"]


def test_new_zeros_reach_the_disk_before_their_name(tmp_path, monkeypatch):
    order = []
    fsync, replace = os.fsync, module.Path.replace
    monkeypatch.setattr(module.os, "fsync", lambda f: (order.append("fsync"), fsync(f)))
    monkeypatch.setattr(
        module.Path, "replace", lambda a, b: (order.append("replace"), replace(a, b))
    )
    save_zeros(tmp_path / "zeros.yaml", PAIR, "loopback", {"thumb_main": 1.0})
    assert order == ["fsync", "replace", "fsync"]  # the file, its name, the folder


GOOD = "servos: pair\ndriver: dynamixel\nzeros: {thumb_main: 1.0}\n"


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("pair", "other", "servos: 'other' is not allowed; must be 'pair'"),
        ("dynamixel", "loopback", "driver: 'loopback' is not allowed; must be 'dynamixel'"),
        ("thumb_main", "thumb_tip", "zeros.thumb_tip: unknown key.*thumb_main"),
        ("1.0", ".nan", "zeros.thumb_main: nan"),
        ("1.0", "1.0e6", "zeros.thumb_main: 1000000.0"),
        ("1.0", "half", "zeros.thumb_main: 'half'"),
        ("{thumb_main: 1.0}", "[1.0]", "zeros: .*a mapping"),
        ("zeros: {thumb_main: 1.0}\n", "", "zeros: missing"),
    ],
)
def test_a_wrong_file_is_told_of(tmp_path, old, new, text):
    path = tmp_path / "zeros.yaml"
    path.write_text(GOOD.replace(old, new), encoding="utf-8")
    with pytest.raises(InvalidValue, match=text) as caught:
        load_zeros(path, PAIR, "dynamixel")
    assert str(caught.value).startswith(f"{path}: ")


@pytest.mark.parametrize("content", ["", "zeros: {", "- 1\n", GOOD[:-12]])
def test_a_torn_file_is_told_of(tmp_path, content):
    path = tmp_path / "zeros.yaml"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(InvalidFile, match=r"zeros\.yaml"):
        load_zeros(path, PAIR, "dynamixel")


def test_where_nothing_can_be_written(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InvalidFile, match="cannot be written"):
        save_zeros(tmp_path / "file" / "zeros.yaml", PAIR, "loopback", {"thumb_main": math.pi})
