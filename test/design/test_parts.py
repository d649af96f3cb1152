# SPDX-License-Identifier: Apache-2.0
"""Parts of a finger at rest: backbone and disks where the solver's rest shape has them, holes."""

from __future__ import annotations

import csv
import math

import numpy as np
import pytest
from model.fingers import make_finger, straight_cable

from ccr_ros.design.curve_files import load_curve
from ccr_ros.design.part_tables import write_tables
from ccr_ros.design.parts import PrintOptions, finger_parts
from ccr_ros.model import Cable, FingerSolver, InvalidFile, InvalidValue, load_finger
from ccr_ros.resources import find_config

BENT = load_finger(find_config("sphere_finger"))


def test_backbone_and_disks_are_the_rest_shape():
    rest = FingerSolver(BENT).rest
    parts = finger_parts(BENT)
    # The solver's arcs of linear curvature are good to a micrometre; these are shorter ones.
    assert np.allclose(parts.centers[parts.disks], rest.backbone, atol=1e-6)
    assert np.allclose(parts.frames[parts.disks], rest.frames, atol=1e-7)
    steps = np.linalg.norm(np.diff(parts.centers, axis=0), axis=1)
    assert steps.sum() == pytest.approx(BENT.length, rel=1e-4)


def test_holes_are_the_clocks_and_those_of_cables_between_them():
    free = Cable("free", np.radians([45.0, 45.5, 30.0, 365.0]))
    finger = make_finger(straight_cable(4), free)
    holes = finger_parts(finger).holes
    by_disk = [[h for h in holes if h.disk == d] for d in range(10)]
    at_45 = next(h for h in by_disk[0] if h.cables == ("free",))
    assert at_45.number == 0 and math.degrees(at_45.angle) == pytest.approx(45)
    assert [h.number for h in by_disk[0]] == [1, 2, 0, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12]
    assert next(h for h in by_disk[2] if h.cables == ("free",)).number == 2
    # 5 degrees from hole 1, 0.7 mm: the clock hole that it would cut is left out
    assert [h.number for h in by_disk[3]] == [0, *range(2, 13)]
    assert len(by_disk[9]) == 12
    assert all(any("straight" in h.cables for h in d) for d in by_disk)
    routed = finger_parts(finger, PrintOptions(routed_only=True)).holes
    assert [h.cables for h in routed if h.disk in (0, 9)] == [
        ("free",),
        ("straight",),
        ("straight",),
    ]


def test_two_cables_in_one_hole():
    finger = make_finger(straight_cable(4), Cable("other", straight_cable(4).angles))
    (hole,) = [h for h in finger_parts(finger, PrintOptions(routed_only=True)).holes if h.disk == 3]
    assert hole.cables == ("straight", "other") and hole.number == 4


def test_tables_say_where_all_is(tmp_path):
    parts = finger_parts(BENT)
    paths = {p.stem: p for p in write_tables(parts, tmp_path, "f")}
    assert sorted(paths) == ["f_backbone", "f_disks", "f_holes"]
    curve = load_curve(paths["f_backbone"], "mm")
    assert curve.length == pytest.approx(BENT.length, rel=1e-6)
    rest = FingerSolver(BENT).rest
    rows = list(csv.DictReader(paths["f_disks"].open()))
    for row, center, frame in zip(rows, rest.backbone, rest.frames, strict=True):
        assert np.allclose([float(row[k]) for k in "xyz"], 1e3 * center, atol=1e-3)
        assert np.allclose([float(row[f"normal_{k}"]) for k in "xyz"], frame[:, 2], atol=1e-6)
        assert np.allclose([float(row[f"hole1_{k}"]) for k in "xyz"], frame[:, 0], atol=1e-6)
    holes = list(csv.DictReader(paths["f_holes"].open()))
    assert len(holes) == 120
    routed = [row for row in holes if row["cables"] == "main"]
    points = np.array([[float(row[k]) for k in "xyz"] for row in routed])
    assert np.allclose(points, 1e3 * rest.cables["main"], atol=1e-3)
    assert {row["hole"] for row in routed} == {"1"}
    assert np.allclose([float(routed[7][f"axis_{k}"]) for k in "xyz"], rest.frames[7][:, 2])
    with pytest.raises(InvalidFile, match="cannot be written"):
        write_tables(parts, tmp_path / "none", "f")


@pytest.mark.parametrize(
    ("options", "place", "words"),
    [
        ({"disk_thickness": 0}, "disk_thickness", ">= 1e-05"),
        ({"disk_thickness": math.nan}, "disk_thickness", "finite"),
        ({"hole_diameter": -1}, "hole_diameter", ">= 1e-05"),
        ({"outer_radius": math.inf}, "outer_radius", "finite"),
        ({"plate_thickness": 0}, "plate_thickness", ">= 1e-05"),
        ({"plate_diameter": -0.01}, "plate_diameter", ">= 0"),
        ({"hole_diameter": 0.0135}, "hole_diameter", "< 0.0135 m, or holes cut the backbone"),
        ({"outer_radius": 0.0085}, "outer_radius", "> 0.008625 m, or holes cut the disk's rim"),
        ({"plate_diameter": 0.018}, "plate_diameter", ">= 0.0185 m, the disks' diameter"),
        ({"hole_diameter": 0.0042}, "hole_diameter", "< 0.0041411 m: two holes of disk 0"),
        ({"disk_thickness": 0.0195}, "disk_thickness", "at rest disks"),
    ],
)
def test_refused(options, place, words):
    with pytest.raises(InvalidValue) as caught:
        finger_parts(BENT, PrintOptions(**options))
    assert caught.value.place == place and words in str(caught.value)


def test_disks_that_touch_are_told_by_how_much():
    tight = make_finger(straight_cable(1), rest_curvature=np.tile([0.0, 60.0, 0.0], (9, 1)))
    with pytest.raises(InvalidValue, match=r"disks \d and \d would touch") as caught:
        finger_parts(tight, PrintOptions(outer_radius=0.016))
    # On a circle the planes meet at its centre, 1/60 m away: there is no room for 2 mm at 16 mm.
    turn = 60 * 0.182 / 9
    gap = (1 / 60 - 0.016) * math.sin(turn)
    assert f"less by {(0.002 - gap) * 1e3:.3g} mm" in str(caught.value)
