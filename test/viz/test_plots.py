# SPDX-License-Identifier: Apache-2.0
"""Plots of a pose: the picture's data are the solution's, and bad paths are told before drawing."""

import sys
from dataclasses import replace

import numpy as np
import pytest
import synthetic

from ccr_ros.model import (
    Box,
    Capsule,
    CcrError,
    ConvexMesh,
    Cylinder,
    InvalidFile,
    InvalidValue,
    Plane,
    Pose,
)
from ccr_ros.viz.plots import figure_of_solution, plot_solution
from ccr_ros.viz.shapes import hull, obstacle_surface, smooth, surface

mpl_image = pytest.importorskip(
    "matplotlib.image", reason="matplotlib, the extra 'plot', is not installed"
)

BALL = synthetic.BALL.moved(synthetic.bases()[0].inverse())


@pytest.fixture(scope="module")
def solution():
    finger = synthetic.finger(obstacles=(BALL,))
    free = synthetic.solution(1.0, of=finger)
    return replace(free, contacts=synthetic.touching(free, BALL, 0.0008, 0.6))


def lines(axes, label):
    """Data of the line in the axes whose legend text begins with the label, one row per point."""
    line = next(li for li in axes.get_lines() if str(li.get_label()).startswith(label))
    data = line.get_data_3d() if hasattr(line, "get_data_3d") else line.get_data()
    return np.column_stack(data)


def test_every_view_shows_the_solution_in_millimetres(solution) -> None:
    rest = synthetic.solution(0.0)
    figure = figure_of_solution(solution, rest=rest)
    views = {axes.get_label(): axes for axes in figure.axes}
    assert list(views) == ["3-D", "x-z", "y-z"]
    for name, keep in (("3-D", [0, 1, 2]), ("x-z", [0, 2]), ("y-z", [1, 2])):
        axes = views[name]
        np.testing.assert_allclose(lines(axes, "backbone"), solution.centerline[:, keep] * 1e3)
        np.testing.assert_allclose(lines(axes, "rest shape"), rest.centerline[:, keep] * 1e3)
        np.testing.assert_allclose(
            lines(axes, "cable inner: 8 N"), solution.cables["inner"][:, keep] * 1e3
        )
        np.testing.assert_allclose(
            lines(axes, "cable outer: slack"), solution.cables["outer"][:, keep] * 1e3
        )
        arrow = lines(axes, "contact")
        first = solution.contacts[0]
        np.testing.assert_allclose(arrow[0], first.position[keep] * 1e3)
        direction = (arrow[1] - arrow[0]) / 1e3
        assert direction @ first.normal[keep] == pytest.approx(
            np.linalg.norm(direction) * np.linalg.norm(first.normal[keep])
        )


def test_arrows_are_as_long_as_forces_are_strong(solution) -> None:
    side = figure_of_solution(solution).axes[1]
    points = [c.position[[0, 2]] * 1e3 for c in solution.contacts]
    lengths = []
    for start in points:
        arrow = next(
            d
            for li in side.get_lines()
            if len(d := np.column_stack(li.get_data())) == 2 and np.allclose(d[0], start)
        )
        lengths.append(np.linalg.norm(arrow[1] - arrow[0]))
    forces = [c.force for c in solution.contacts]
    np.testing.assert_allclose(
        np.array(lengths) / lengths[-1], np.array(forces) / forces[-1], rtol=1e-9
    )
    assert len(lengths) == 4


def test_disks_are_circles_square_to_the_backbone(solution) -> None:
    space = figure_of_solution(solution).axes[0]
    closed = [
        np.column_stack(li.get_data_3d())
        for li in space.get_lines()
        if len(li.get_data_3d()[0]) > 20
        and np.allclose(*np.column_stack(li.get_data_3d())[[0, -1]])
    ]
    assert len(closed) == 10
    for i, rim in enumerate(closed):
        arm = rim / 1e3 - solution.backbone[i]
        np.testing.assert_allclose(np.linalg.norm(arm, axis=1), 0.008, atol=1e-12)
        np.testing.assert_allclose(arm @ solution.frames[i][:, 2], 0, atol=1e-12)


def test_scales_are_equal_and_hold_the_obstacle(solution) -> None:
    figure = figure_of_solution(solution)
    space = figure.axes[0]
    spans = np.ptp([space.get_xlim(), space.get_ylim(), space.get_zlim()], axis=1)
    np.testing.assert_allclose(
        spans / spans[2], space._box_aspect / space._box_aspect[2], rtol=1e-9
    )
    for axes, a in ((figure.axes[1], 0), (figure.axes[2], 1)):
        assert axes.get_aspect() == 1
        low, high = axes.get_xlim()
        assert (
            low < (BALL.center[a] - BALL.radius) * 1e3
            and (BALL.center[a] + BALL.radius) * 1e3 < high
        )


def test_title_tells_name_pulls_and_certificate(solution) -> None:
    good = " ".join(t.get_text() for t in figure_of_solution(solution).texts)
    assert "finger" in good and "inner 5.5 mm" in good and "converged, stable" in good
    bad = synthetic.solution(0.5, converged=False)
    assert "NOT CONVERGED" in " ".join(t.get_text() for t in figure_of_solution(bad).texts)


def test_the_file_is_a_picture_of_that_size(solution, tmp_path) -> None:
    path = plot_solution(solution, tmp_path / "pose.png")
    image = mpl_image.imread(path)
    assert image.shape[:2] == (1020, 2100)
    assert len(np.unique((image[::4, ::4, :3] * 31).astype(int).reshape(-1, 3), axis=0)) > 30


def test_all_kinds_of_obstacles_are_drawn(tmp_path) -> None:
    finger = synthetic.finger(
        obstacles=(
            Cylinder(np.array([0.03, 0, 0.1]), np.array([0, 1, 0.2]), 0.015),
            Box(np.array([-0.05, 0, 0.06]), np.array([0.04, 0.03, 0.06])),
            Plane(np.array([0, 0, -0.01]), np.array([0.0, 0, 1])),
            Capsule([0.1, 0, 0.1], [0.1, 0, 0.15], 0.02),
            ConvexMesh.hull_of([[0.1, 0, 0], [0.2, 0, 0], [0.1, 0.1, 0], [0.1, 0, 0.03]]),
        )
    )
    figure = figure_of_solution(synthetic.solution(0.3, of=finger))
    assert len(figure.axes[0].collections) == 5
    cylinder, box, plane, capsule, mesh = (p.get_xy() for p in figure.axes[1].patches[:5])
    np.testing.assert_allclose([cylinder[:, 0].min(), cylinder[:, 0].max()], [15, 45], atol=0.1)
    np.testing.assert_allclose(
        [box.min(axis=0), box.max(axis=0)], [[-70, 30], [-30, 90]], atol=1e-6
    )
    assert plane[:, 1].max() == pytest.approx(-10)
    np.testing.assert_allclose([capsule.min(axis=0), capsule.max(axis=0)], [[80, 80], [120, 170]])
    np.testing.assert_allclose(
        [mesh.min(axis=0), mesh.max(axis=0)], [[100, 0], [200, 30]], atol=1e-9
    )


@pytest.mark.parametrize(
    ("name", "error", "words"),
    [
        ("pose.jpeg2000", InvalidValue, r"must be a name that ends in \.png"),
        ("pose", InvalidValue, r"\.png"),
        ("no/pose.png", InvalidFile, "there is no directory"),
        ("dir.png", InvalidFile, "is a directory"),
    ],
)
def test_bad_paths_are_refused(solution, tmp_path, name, error, words) -> None:
    (tmp_path / "dir.png").mkdir()
    with pytest.raises(error, match=words):
        plot_solution(solution, tmp_path / name)


def test_without_matplotlib_the_error_says_what_to_install(solution, tmp_path, monkeypatch) -> None:
    for module in [m for m in sys.modules if m.split(".")[0] == "matplotlib"]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(CcrError, match="extra 'plot'"):
        plot_solution(solution, tmp_path / "pose.png")


def test_surfaces_lie_on_their_obstacles() -> None:
    center = np.array([0.0, 0.0, 0.09])
    for obstacle in (
        BALL,
        Cylinder(np.array([0.3, 0.0, 0.0]), np.array([1.0, 0.2, 0.3]), 0.015),
    ):
        skin = obstacle_surface(obstacle, center, 0.2)
        np.testing.assert_allclose(obstacle.signed_distance(skin.vertices), 0, atol=1e-9)
    far_plane = Plane(np.array([5.0, 5.0, 0.02]), np.array([0.0, 0.0, 1.0]))
    shown = obstacle_surface(far_plane, center, 0.2).vertices
    np.testing.assert_allclose(shown.mean(axis=0)[:2], center[:2], atol=1e-9)
    assert shown[:, 2].max() == pytest.approx(0.02)


def test_hull_is_the_outline_of_points() -> None:
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0.5], [0.5, 0.0], [1, 1]])
    assert {tuple(p) for p in hull(square)} == {(0, 0), (1, 0), (1, 1), (0, 1)}
    assert len(hull(np.array([[0, 0], [1, 1], [0, 0]]))) == 2


def test_smooth_curve_passes_the_disks_close_to_an_arc() -> None:
    angle = np.linspace(0, 1.2, 7)
    arc = np.column_stack([1 - np.cos(angle), 0 * angle, np.sin(angle)])
    tangents = np.column_stack([np.sin(angle), 0 * angle, np.cos(angle)])
    curve = smooth(arc, tangents, 4)
    np.testing.assert_allclose(curve[::4], arc, atol=1e-12)
    radii = np.linalg.norm(curve - [1, 0, 0], axis=1)
    np.testing.assert_allclose(radii, 1, atol=2e-4)


def test_a_body_is_drawn_where_its_pose_says() -> None:
    from ccr_ros.viz.recording import SolidObject

    turned = Pose(np.array([0.1, 0, 0]), np.array([0, np.sqrt(0.5), 0, np.sqrt(0.5)]))
    rod = surface(SolidObject("rod", "cylinder", (0.2, 0.01), turned)).vertices
    np.testing.assert_allclose([rod[:, 0].min(), rod[:, 0].max()], [0.0, 0.2], atol=1e-12)
    np.testing.assert_allclose(np.abs(rod[:, 2]).max(), 0.01, atol=1e-12)


def test_faces_have_as_many_corners_each(monkeypatch) -> None:
    """Matplotlib leaves corners of shorter ones unset, and may take infinite limits of them."""
    art3d = pytest.importorskip("mpl_toolkits.mplot3d.art3d")
    drawn = []

    class Kept(art3d.Poly3DCollection):
        def __init__(self, faces, **options):
            drawn.append(faces)
            super().__init__(faces, **options)

    monkeypatch.setattr(art3d, "Poly3DCollection", Kept)
    can = Cylinder(np.array([0.03, 0, 0.1]), np.array([0, 1, 0.2]), 0.015)
    figure_of_solution(synthetic.solution(0.3, of=synthetic.finger(obstacles=(can,))))
    (faces,) = drawn
    assert len({len(face) for face in faces}) == 1
