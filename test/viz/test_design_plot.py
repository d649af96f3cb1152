# SPDX-License-Identifier: Apache-2.0
"""Plots of designs: wanted, rest and actuated shape and the errors are what was given."""

import sys

import numpy as np
import pytest
import synthetic

from ccr_ros.design.target import DesiredShape
from ccr_ros.model import CcrError, InvalidValue
from ccr_ros.viz import palette
from ccr_ros.viz.design_plot import figure_of_design, plot_design

mpl_image = pytest.importorskip(
    "matplotlib.image", reason="matplotlib, the extra 'plot', is not installed"
)

to_hex = pytest.importorskip("matplotlib.colors").to_hex

VIEWS = (("3-D", [0, 1, 2]), ("x-z", [0, 2]), ("y-z", [1, 2]))


@pytest.fixture(scope="module")
def solution():
    return synthetic.solution(1.0)


@pytest.fixture(scope="module")
def wanted(solution):
    off = np.linspace(0, 1e-3, len(solution.backbone))
    return DesiredShape(solution.backbone + off[:, None] * [0.6, 0.8, 0.0])


def data(line):
    return np.column_stack(line.get_data_3d() if hasattr(line, "get_data_3d") else line.get_data())


def labelled(axes, label):
    return data(next(li for li in axes.get_lines() if str(li.get_label()).startswith(label)))


def test_every_view_shows_wanted_rest_and_actuated_shape(solution, wanted):
    rest = synthetic.solution(0.0)
    curve = np.linspace([0, 0, 0], [0.01, 0, 0.1], 40)
    figure = figure_of_design(solution, wanted, rest=rest, curve=curve)
    views = {axes.get_label(): axes for axes in figure.axes}
    assert list(views) == ["3-D", "x-z", "y-z", "error"]
    for name, keep in VIEWS:
        axes = views[name]
        np.testing.assert_allclose(labelled(axes, "wanted"), curve[:, keep] * 1e3)
        np.testing.assert_allclose(labelled(axes, "rest"), rest.centerline[:, keep] * 1e3)
        np.testing.assert_allclose(labelled(axes, "backbone"), solution.centerline[:, keep] * 1e3)
        rings = [li for li in axes.get_lines() if to_hex(li.get_mec()) == palette.WANTED]
        centers = next(data(li) for li in rings if len(data(li)) == len(wanted.points))
        np.testing.assert_allclose(centers, wanted.points[:, keep] * 1e3)
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "wanted" in legend and "rest shape" in legend and "backbone" in legend


def test_errors_are_drawn_in_millimetres(solution, wanted):
    axes = figure_of_design(solution, wanted).axes[-1]
    (line,) = axes.get_lines()
    disks = np.arange(1, len(wanted.points))
    np.testing.assert_allclose(data(line), np.column_stack([disks, disks / disks[-1]]))
    assert axes.get_yscale() == "log"
    assert f"sum of squares {np.sum((disks / disks[-1]) ** 2):.2g} mm²" in axes.get_title()


def test_a_shape_that_is_reached_exactly_can_be_drawn(solution, tmp_path):
    out = plot_design(tmp_path / "d.png", solution, DesiredShape.of(solution))
    picture = mpl_image.imread(out)
    assert picture.shape[1] > 2000 and picture[..., :3].std() > 0.02


def test_without_a_curve_one_is_drawn_through_the_disks(solution, wanted):
    for shape in (wanted, DesiredShape.of(solution)):
        drawn = labelled(figure_of_design(solution, shape).axes[0], "wanted")
        gaps = np.linalg.norm(drawn[None] - 1e3 * shape.points[:, None], axis=2).min(axis=1)
        assert gaps.max() < 1e-9
        assert len(drawn) == 8 * shape.segments + 1


def test_refused(solution, wanted, tmp_path, monkeypatch):
    with pytest.raises(InvalidValue, match="plot file"):
        plot_design(tmp_path / "d.txt", solution, wanted)
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(CcrError, match="needs matplotlib"):
        plot_design(tmp_path / "d.png", solution, wanted)
