# SPDX-License-Identifier: Apache-2.0
"""Curves from files of points: they are the curve the points were taken from."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from ccr_ros.design.curve_files import load_curve
from ccr_ros.design.curves import helix
from ccr_ros.model import InvalidFile, InvalidValue
from ccr_ros.model.errors import MissingPackage

L = 0.182
CURVE = helix(L, 0.02, 1.1)


def written(tmp_path, points, header="x,y,z\n"):
    path = tmp_path / "points.csv"
    path.write_text(header + "".join(",".join(f"{v:.17g}" for v in p) + "\n" for p in points))
    return path


def test_points_give_the_curve_back(tmp_path):
    # not evenly spaced: the arc length must come from the curve, not from the points' number
    s = L * np.linspace(0, 1, 150) ** 1.3
    curve = load_curve(written(tmp_path, CURVE.points(s)))
    assert curve.length == pytest.approx(L, abs=1e-9)
    at = np.linspace(0, curve.length, 400)
    assert np.abs(curve.points(at) - CURVE.points(np.minimum(at, L))).max() < 1e-8
    assert np.abs(curve.tangents(at) - CURVE.tangents(np.minimum(at, L))).max() < 1e-4
    assert np.abs(curve.curvatures(at) - CURVE.curvatures(0.0)).max() < 0.1


def test_arc_length_is_that_of_the_spline(tmp_path):
    curve = load_curve(written(tmp_path, CURVE.points(np.linspace(0, L, 12))))
    for end in (0.3, 0.77, 1.0):
        dense = curve.points(np.linspace(0, end * curve.length, 20_001))
        length = np.linalg.norm(np.diff(dense, axis=0), axis=1).sum()
        assert length == pytest.approx(end * curve.length, rel=1e-8)


def test_millimetres(tmp_path):
    points = CURVE.points(np.linspace(0, L, 50))
    metres = load_curve(written(tmp_path, points, ""))
    millimetres = load_curve(written(tmp_path, 1e3 * points), "mm")
    assert millimetres.length == pytest.approx(metres.length, rel=1e-12)
    with pytest.raises(InvalidValue, match="unit: 'inch' is not allowed; must be one of m, mm"):
        load_curve(written(tmp_path, points), "inch")


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ([[0, 0, 0], [0, 0, 1], [0, 0, 2]], "holds 3 points; at least 4"),
        (
            [[0, 0, 0], [0, 0, 1], [0, 0, 1], [0, 0, 2]],
            "line 4: [0.0, 0.0, 1.0] is the point",
        ),
        ([[0, 0, 0], [0, 0, 1], [0, 0, 2e3], [0, 0, 1]], "line 4: [0.0, 0.0, 2000.0] is more than"),
    ],
)
def test_refused(tmp_path, rows, words):
    with pytest.raises(InvalidFile) as caught:
        load_curve(written(tmp_path, rows))
    assert words in str(caught.value)


def test_without_scipy_it_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "scipy.interpolate", None)
    with pytest.raises(MissingPackage, match=r"needs scipy, .* its extra 'design'"):
        load_curve(written(tmp_path, CURVE.points(np.linspace(0, L, 50))))
