# SPDX-License-Identifier: Apache-2.0
"""The plot of a turn in hand: pulls, forces and margins against degrees."""

from types import SimpleNamespace

import numpy as np
import pytest

from ccr_ros.design.turn import TurnRecord
from ccr_ros.model import InvalidValue
from ccr_ros.viz.turn_plot import figure_of_turn, plot_turn

pytest.importorskip("matplotlib", reason="matplotlib, the extra 'plot', is not installed")

RECORD = TurnRecord(
    angles=np.deg2rad([-20.0, 0.0, 30.0]),
    pulls=np.array([[1.0, 2.0, 3.0], [2.0, 2.0, 2.0], [3.0, 2.5, 1.0]]) * 1e-3,
    cables=("thumb.left", "thumb.right", "finger.main"),
    forces=np.array([[0.1, 0.2], [0.1, 0.1], [0.2, 0.1]]),
    margins=np.array([[0.5, np.nan], [0.6, 0.7], [0.2, 0.1]]),
    fingers=("thumb", "finger"),
)


def way(degrees, limiting):
    moved = np.array([0, 0, 0, 0, 0, np.deg2rad(degrees)])
    return SimpleNamespace(plan=SimpleNamespace(moved=moved), limiting=limiting)


RESULT = SimpleNamespace(ways=(way(30.0, "drift"), way(-20.0, "")))


def lines(axes):
    return {str(line.get_label()): line for line in axes.get_lines()}


def test_pulls_forces_and_margins_are_drawn_over_degrees():
    figure = figure_of_turn("hand", RECORD, RESULT)
    panels = {axes.get_label(): lines(axes) for axes in figure.axes}
    assert list(panels) == ["pulls", "forces", "margins"]
    for j, cable in enumerate(RECORD.cables):
        x, y = panels["pulls"][cable].get_data()
        np.testing.assert_allclose(x, [-20, 0, 30])
        np.testing.assert_allclose(y, RECORD.pulls[:, j] * 1e3)
    left, right = panels["pulls"]["thumb.left"], panels["pulls"]["thumb.right"]
    assert left.get_color() == right.get_color() and left.get_linestyle() != right.get_linestyle()
    for k, finger in enumerate(RECORD.fingers):
        np.testing.assert_allclose(panels["forces"][finger].get_ydata(), RECORD.forces[:, k])
        np.testing.assert_allclose(panels["margins"][finger].get_ydata(), RECORD.margins[:, k])
    texts = " ".join(text.get_text() for text in figure.texts)
    assert "hand" in texts and "+30.0 deg: drift" in texts and "-20.0 deg" in texts


def test_a_bad_path_is_refused(tmp_path):
    with pytest.raises(InvalidValue):
        plot_turn(tmp_path / "x.txt", "hand", RECORD, RESULT)
    assert plot_turn(tmp_path / "x.png", "hand", RECORD, RESULT).stat().st_size > 10_000
