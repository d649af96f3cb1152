# SPDX-License-Identifier: Apache-2.0
"""Strips: which moments they show, and that what they show is the recording."""

from dataclasses import replace

import numpy as np
import pytest
import synthetic

from ccr_ros.model import InvalidFile, InvalidValue
from ccr_ros.viz.sketch import View, bounds
from ccr_ros.viz.strip import figure_of_recording, moments, write_strip

mpl_image = pytest.importorskip(
    "matplotlib.image", reason="matplotlib, the extra 'plot', is not installed"
)


@pytest.fixture(scope="module")
def recording():
    return synthetic.recording(duration=10.0, rate=5.0)


@pytest.fixture(scope="module")
def figure(recording):
    return figure_of_recording(recording, 3)


def test_moments_are_first_last_and_the_changes_between(recording) -> None:
    shown = moments(recording, 5)
    assert len(shown) == 5 and shown[0] == 0 and shown[-1] == len(recording.frames) - 1
    assert list(shown) == sorted(set(shown))
    pulls = [recording.frames[i].fingers["finger_1"].pulls[0] for i in shown]
    assert (
        pulls[0] == pytest.approx(0) and pulls[2] == pytest.approx(0.0055) and 0 < pulls[1] < 0.0055
    )


def test_moments_of_short_and_still_recordings(recording) -> None:
    assert moments(replace(recording, frames=recording.frames[:1]), 5) == (0,)
    assert moments(replace(recording, frames=recording.frames[:3]), 5) == (0, 1, 2)
    assert moments(recording, 1) == (0,)
    for count in (0, 13, 2.5):
        with pytest.raises(InvalidValue, match="count"):
            moments(recording, count)


def test_curves_are_the_recorded_pulls_and_tensions(recording, figure) -> None:
    views = {axes.get_label(): axes for axes in figure.axes}
    times = [f.time for f in recording.frames]
    for label, value in (
        ("tension", lambda f: f.tensions[0]),
        ("pull", lambda f: f.pulls[0] * 1e3),
    ):
        for name in ("finger_1", "finger_3"):
            line = next(li for li in views[label].get_lines() if li.get_label() == f"{name} inner")
            np.testing.assert_allclose(line.get_xdata(), times)
            np.testing.assert_allclose(
                line.get_ydata(), [value(f.fingers[name]) for f in recording.frames]
            )


def test_each_moment_shows_fingers_ball_and_contacts(recording, figure) -> None:
    view, shown = View(), moments(recording, 3)
    for axes, index in zip(figure.axes[:3], shown, strict=True):
        frame = recording.frames[index]
        assert f"{frame.time:.1f} s" in axes.get_title()
        drawn = np.vstack([np.column_stack(li.get_data()) for li in axes.get_lines()])
        for name, moment in frame.fingers.items():
            for point in view.flat(recording.finger(name).base.points(moment.backbone)):
                assert np.linalg.norm(drawn - point, axis=1).min() < 1e-9
        contacts = sum(len(f.contacts) for f in frame.fingers.values())
        assert len(axes.texts) == contacts  # one arrow each
        left, right, low, high = axes.images[0].get_extent()
        np.testing.assert_allclose([right - left, high - low], 112.0)
        assert axes.get_aspect() == 1
    assert "9 contacts" in figure.axes[1].get_title()


def test_what_is_nearer_is_painted_later(recording, figure) -> None:
    axes = figure.axes[0]
    base = [recording.fingers[k].base.position for k in range(3)]
    view = View()
    order = np.argsort([p @ view.towards_viewer for p in base])
    foot = [view.flat(p[None])[0] for p in base]
    painted = [
        min(
            li.get_zorder()
            for li in axes.get_lines()
            if np.allclose(np.column_stack(li.get_data())[0], foot[k], atol=1e-9)
        )
        for k in order
    ]
    assert painted == sorted(painted)


def test_bounds_hold_every_disk_of_every_frame(recording) -> None:
    view = View()
    low, high = bounds(recording, view)
    for frame in recording.frames:
        for name, moment in frame.fingers.items():
            flat = view.flat(recording.finger(name).base.points(moment.backbone))
            assert np.all(flat > low) and np.all(flat < high)


def test_the_file_is_a_picture_and_bad_paths_are_refused(recording, tmp_path) -> None:
    image = mpl_image.imread(write_strip(recording, tmp_path / "strip.png", 4))
    assert image.shape[1] == round(4 * 2.9 * 120)
    assert 700 < image.shape[0] < 1400
    assert len(np.unique((image[::4, ::4, :3] * 31).astype(int).reshape(-1, 3), axis=0)) > 60
    with pytest.raises(InvalidFile, match="no directory"):
        write_strip(recording, tmp_path / "no" / "strip.png")


def test_unheard_and_faded_fingers_do_not_hinder(recording) -> None:
    first, *others = recording.frames
    silent = replace(first, fingers={})
    frames = (silent, *others)
    figure = figure_of_recording(replace(recording, frames=frames), 2)
    assert not figure.axes[0].get_lines()
    assert figure.axes[1].get_lines()


def test_force_servo_angles_and_phases_are_drawn_where_they_are_known(recording, figure) -> None:
    labels = [axes.get_label() for axes in figure.axes if not axes.get_label().startswith("t=")]
    assert labels == ["tension", "force", "pull", "servo"]
    views = {axes.get_label(): axes for axes in figure.axes}
    servo = next(li for li in views["servo"].get_lines() if li.get_label() == "finger_1 inner")
    angles = [f.fingers["finger_1"].servo_angles[0] for f in recording.frames]
    np.testing.assert_allclose(servo.get_ydata(), np.degrees(angles))
    assert {t.get_text() for t in views["tension"].texts} >= {"closing", "holding", "releasing"}
    bare = replace(
        recording,
        frames=tuple(
            replace(
                frame,
                phase="",
                fingers={
                    n: replace(f, servo_angles=None, contacts=()) for n, f in frame.fingers.items()
                },
            )
            for frame in recording.frames[:3]
        ),
    )
    labels = [axes.get_label() for axes in figure_of_recording(bare, 2).axes]
    assert [name for name in labels if not name.startswith("t=")] == ["tension", "pull"]
