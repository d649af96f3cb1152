# SPDX-License-Identifier: Apache-2.0
"""The plot of pulls: points that were to be reached and the tip's path, in millimetres."""

import numpy as np
import pytest
import synthetic

from ccr_ros.model import InvalidValue
from ccr_ros.viz.pulls_plot import figure_of_pulls, plot_pulls

pytest.importorskip("matplotlib", reason="matplotlib, the extra 'plot', is not installed")


@pytest.fixture(scope="module")
def solution():
    return synthetic.solution(1.0)


def lines(axes):
    return {str(line.get_label()): line for line in axes.get_lines()}


def test_points_and_path_are_drawn_in_every_view(solution):
    wanted = np.array([[0.3, 0.01, 0.02], [0.0, -0.2, 0.1]])
    track = np.linspace([0, 0, 0.1], [0.05, 0, 0.1], 5)
    figure = figure_of_pulls(solution, wanted, track=track)
    views = {axes.get_label(): axes for axes in figure.axes}
    assert list(views) == ["3-D", "x-z", "y-z"]
    for name, keep in (("x-z", [0, 2]), ("y-z", [1, 2])):
        drawn = lines(views[name])
        np.testing.assert_allclose(
            np.column_stack(drawn["wanted"].get_data()), wanted[:, keep] * 1e3
        )
        np.testing.assert_allclose(
            np.column_stack(drawn["path of the tip"].get_data()), track[:, keep] * 1e3
        )
    low, high = views["x-z"].get_xlim()
    assert low < 0.0 and high > 300.0  # far targets are in view


def test_many_points_are_a_line_and_none_are_nothing(solution):
    many = np.linspace([0, 0, 0.1], [0.05, 0, 0.1], 60)
    assert lines(figure_of_pulls(solution, many).axes[1])["wanted"].get_linewidth() > 1
    assert "wanted" not in lines(figure_of_pulls(solution, np.zeros((0, 3))).axes[1])


def test_bad_path_is_refused_before_drawing(solution, tmp_path):
    with pytest.raises(InvalidValue):
        plot_pulls(tmp_path / "x.txt", solution, np.zeros((0, 3)))
    assert plot_pulls(tmp_path / "x.png", solution, np.zeros((0, 3))).stat().st_size > 10_000
