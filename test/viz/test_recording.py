# SPDX-License-Identifier: Apache-2.0
"""Recordings: what they refuse, what survives a round trip, and how they are built from topics."""

import json
from dataclasses import replace

import numpy as np
import pytest
import synthetic

from ccr_ros.model import (
    Contact,
    Gripper,
    InvalidFile,
    InvalidValue,
    MountedFinger,
    Pose,
    UnknownName,
)
from ccr_ros.viz.recording import FingerFrame, Frame, RecordedFinger, Recording, SolidObject
from ccr_ros.viz.recording_builder import RecordingBuilder
from ccr_ros.viz.recording_json import (
    load_recording,
    recording_from_json,
    recording_to_json,
    save_recording,
)

FINGER = RecordedFinger("one", Pose(), 0.008, ("inner", "outer"))


def moment(**changes: object) -> FingerFrame:
    pose = synthetic.solution(0.5)
    values = {
        "pulls": pose.pulls,
        "tensions": pose.tensions,
        "backbone": pose.backbone,
        "orientations": pose.quaternions,
        "cables": pose.cables,
    }
    return FingerFrame(**{**values, **changes})


def a_recording(**changes: object) -> Recording:
    values = {"gripper": "g", "fingers": (FINGER,), "frames": (Frame(0.0, {"one": moment()}),)}
    return Recording(**{**values, **changes})


def test_round_trip_keeps_everything_to_a_micrometre() -> None:
    before = synthetic.recording(duration=2.0, rate=10.0)
    after = recording_from_json(recording_to_json(before))
    assert after.gripper == before.gripper
    assert [f.name for f in after.fingers] == ["finger_1", "finger_2", "finger_3"]
    assert after.fingers[1].rest_lengths == before.fingers[1].rest_lengths
    assert after.objects[0].kind == "sphere" and after.objects[0].dimensions == (0.056,)
    assert len(after.frames) == 21
    assert [name for _, name in after.phases] == [name for _, name in before.phases]
    assert [time for time, _ in after.phases] == pytest.approx([time for time, _ in before.phases])
    assert len(after.phases) == 5
    assert np.allclose(
        after.frames[9].fingers["finger_1"].servo_angles,
        before.frames[9].fingers["finger_1"].servo_angles,
        atol=1e-5,
    )
    touched = 0
    for a, b in zip(after.frames, before.frames, strict=True):
        assert a.time == pytest.approx(b.time, abs=1e-6)
        assert a.objects is not None and set(a.objects) == {"ball"}
        for name, was in b.fingers.items():
            now = a.fingers[name]
            np.testing.assert_allclose(now.backbone, was.backbone, atol=5.1e-7)
            np.testing.assert_allclose(now.cables["inner"], was.cables["inner"], atol=5.1e-7)
            np.testing.assert_allclose(now.orientations, was.orientations, atol=1e-5)
            np.testing.assert_allclose(now.tensions, was.tensions, rtol=1e-5)
            assert (now.converged, now.stable, now.stale) == (was.converged, was.stable, was.stale)
            assert len(now.contacts) == len(was.contacts)
            for c, d in zip(now.contacts, was.contacts, strict=True):
                assert (c.disk, c.point, c.cable, c.obstacle) == (
                    d.disk,
                    d.point,
                    d.cable,
                    d.obstacle,
                )
                np.testing.assert_allclose(c.position, d.position, atol=5.1e-7)
                touched += 1
    assert touched > 0


def test_json_is_rounded_and_lengths_do_not_drift_on_a_second_trip() -> None:
    text = recording_to_json(synthetic.recording(duration=1.0, rate=5.0))
    again = recording_to_json(recording_from_json(text))
    for once, twice in zip(json.loads(text)["frames"], json.loads(again)["frames"], strict=True):
        first, second = once["fingers"]["finger_1"], twice["fingers"]["finger_1"]
        assert first["backbone"] == second["backbone"] and first["cables"] == second["cables"]
        assert all(round(x, 6) == x for point in first["backbone"] for x in point)


def test_file_round_trip_and_errors_that_name_the_file(tmp_path) -> None:
    path = tmp_path / "run.json"
    save_recording(a_recording(), path)
    assert load_recording(path).gripper == "g"
    with pytest.raises(InvalidFile, match=r"missing\.json: cannot be read"):
        load_recording(tmp_path / "missing.json")
    with pytest.raises(InvalidFile, match="cannot be written"):
        save_recording(a_recording(), tmp_path / "no" / "run.json")
    path.write_text("{")
    with pytest.raises(InvalidFile, match=r"run\.json: not valid JSON"):
        load_recording(path)
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(InvalidFile, match="not UTF-8"):
        load_recording(path)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda d: d.update(version=2), "version 2"),
        (lambda d: d.update(format="x"), "not a recording"),
        (lambda d: d.pop("frames"), "frames: None is not allowed; must be given"),
        (lambda d: d["fingers"][0].pop("base"), r"fingers\[0\]\.base"),
        (lambda d: d["fingers"][0].update(disk_radius=-1), r"fingers\[0\]\.disk_radius: -1"),
        (
            lambda d: d["frames"][0]["fingers"]["one"].update(pulls=["x", 0]),
            r"frames\[0\]\.fingers\.one\.pulls",
        ),
        (lambda d: d["frames"][0]["fingers"]["one"].update(converged=1), "true or false"),
        (lambda d: d["frames"][0].update(time=None), r"frames\[0\]\.time"),
        (lambda d: d["frames"].append(7), r"frames\[1\]"),
    ],
)
def test_wrong_json_is_refused_with_its_place(change, words) -> None:
    data = json.loads(recording_to_json(a_recording()))
    change(data)
    with pytest.raises((InvalidValue, InvalidFile), match=words):
        recording_from_json(json.dumps(data), "run.json")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"pulls": [0.1, np.nan]}, "pulls"),
        ({"tensions": [1.0]}, "tensions"),
        ({"tensions": [1.0, -2.0]}, r"tensions\[1\]: -2.0"),
        ({"backbone": np.zeros((1, 3)), "orientations": [[0, 0, 0, 1]]}, "at least 2 disk centres"),
        ({"backbone": np.zeros((10, 2))}, "backbone"),
        ({"orientations": np.zeros((10, 4))}, r"orientations\[0\]"),
        ({"cables": {"inner": [[0, 0]]}}, r"cables\.inner"),
        (
            {"contacts": [Contact(10, "cable", "inner", "b", np.zeros(3), np.eye(3)[0], 1.0)]},
            r"contacts\[0\]\.disk",
        ),
        (
            {"contacts": [Contact(9, "nose", "inner", "b", np.zeros(3), np.eye(3)[0], 1.0)]},
            r"contacts\[0\]\.point",
        ),
        (
            {"contacts": [Contact(9, "cable", "inner", "b", np.zeros(3), np.zeros(3), 1.0)]},
            r"contacts\[0\]\.normal",
        ),
    ],
)
def test_wrong_finger_frames_are_refused(change, words) -> None:
    with pytest.raises(InvalidValue, match=words):
        moment(**change)


def test_frames_must_fit_the_recording() -> None:
    with pytest.raises(UnknownName, match="unknown finger 'two'; valid: one"):
        a_recording(frames=(Frame(0.0, {"two": moment()}),))
    with pytest.raises(UnknownName, match="unknown object 'ball'"):
        a_recording(frames=(Frame(0.0, {}, {"ball": Pose()}),))
    with pytest.raises(UnknownName, match="unknown cable"):
        a_recording(frames=(Frame(0.0, {"one": moment(cables={"x": np.zeros((3, 3))})}),))
    with pytest.raises(InvalidValue, match=r"cables\.inner"):
        a_recording(frames=(Frame(0.0, {"one": moment(cables={"inner": np.zeros((11, 3))})}),))
    with pytest.raises(InvalidValue, match=r"frames\[1\]\.time"):
        a_recording(frames=(Frame(1.0, {}), Frame(1.0, {})))
    with pytest.raises(InvalidValue, match="at least one frame"):
        a_recording(frames=())
    with pytest.raises(InvalidValue, match=r"fingers\[1\]\.name"):
        a_recording(fingers=(FINGER, FINGER))
    with pytest.raises(InvalidValue, match="forces_are"):
        a_recording(forces_are="pounds")


def test_a_recording_cannot_be_changed_from_outside() -> None:
    points = np.array(synthetic.solution(0.5).backbone)
    frame = moment(backbone=points)
    points[:] = 7
    assert frame.backbone.max() < 1
    with pytest.raises(ValueError, match="read-only"):
        frame.backbone[0] = 0
    with pytest.raises(TypeError):
        frame.cables["inner"] = points


def test_builder_shows_a_finger_once_all_it_needs_has_arrived() -> None:
    pose = synthetic.solution(0.5)
    builder = RecordingBuilder("g", [FINGER])
    builder.add("one", pulls=pose.pulls, backbone=pose.backbone, orientations=pose.quaternions)
    builder.sample(50.0)
    builder.add("one", tensions=pose.tensions, cables={"inner": pose.cables["inner"]})
    builder.sample(50.1)
    builder.add("one", pulls=2 * pose.pulls, cables={"outer": pose.cables["outer"]}, stale=True)
    builder.sample(50.2)
    recording = builder.build()
    assert [f.time for f in recording.frames] == pytest.approx([0.0, 0.1, 0.2])
    first, second, third = recording.frames
    assert not first.fingers
    assert set(second.fingers["one"].cables) == {"inner"}
    assert set(third.fingers["one"].cables) == {"inner", "outer"}
    np.testing.assert_allclose(third.fingers["one"].pulls, 2 * second.fingers["one"].pulls)
    assert third.fingers["one"].stale and not second.fingers["one"].stale


def test_builder_skips_moments_that_are_not_later() -> None:
    builder = RecordingBuilder("g", [FINGER])
    for t in (5.0, 5.0, 4.0, 6.0):
        builder.sample(t)
    assert len(builder) == 2
    assert [f.time for f in builder.build().frames] == [0.0, 1.0]


def test_builder_follows_objects_that_come_move_and_go() -> None:
    ball = SolidObject("ball", "sphere", (0.05,))
    builder = RecordingBuilder("g", [FINGER])
    builder.sample(0.0)
    builder.set_objects([ball])
    builder.sample(1.0)
    builder.set_objects([replace(ball, pose=Pose(np.array([0, 0, 0.1])))])
    builder.sample(2.0)
    builder.set_objects([])
    builder.sample(3.0)
    recording = builder.build()
    shown = [[o.pose.position[2] for o in recording.objects_at(f)] for f in recording.frames]
    assert shown == [[], [0.0], [0.1], []]
    with pytest.raises(InvalidValue, match=r"objects\.ball"):
        builder.set_objects([SolidObject("ball", "sphere", (0.06,))])
    corners, faces = np.vstack([np.zeros((1, 3)), np.eye(3)]), [[0, 2, 1], [1, 2, 3]]
    wedge = SolidObject("wedge", "mesh", (), Pose(), corners, faces)
    builder.set_objects([wedge])
    builder.set_objects([replace(wedge, vertices=corners.copy())])
    with pytest.raises(InvalidValue, match=r"objects\.wedge.*as before: mesh"):
        builder.set_objects([replace(wedge, vertices=2 * corners)])


def test_builder_of_a_gripper() -> None:
    fingers = [synthetic.finger(f"finger_{k}") for k in range(3)]
    mounted = [MountedFinger(f, b) for f, b in zip(fingers, synthetic.bases(), strict=True)]
    builder = RecordingBuilder.of_gripper(
        Gripper("g", tuple(mounted)), rest_lengths={"finger_1": np.array([0.182, 0.182])}
    )
    with pytest.raises(UnknownName, match="finger_9"):
        builder.add("finger_9")
    with pytest.raises(InvalidValue, match="at least one frame"):
        builder.build()
    builder.sample(0.0)
    recording = builder.build()
    assert recording.forces_are == "newton"
    assert recording.finger("finger_1").rest_lengths == (0.182, 0.182)
    assert recording.finger("finger_2").cables == ("inner", "outer")
    odd = MountedFinger(synthetic.finger("odd", youngs_modulus=None), Pose())
    with pytest.raises(InvalidValue, match="same unit"):
        RecordingBuilder.of_gripper(Gripper("g", (*mounted, odd)))


def test_phases_and_servo_angles_may_be_absent_but_not_wrong() -> None:
    plain = a_recording()
    assert plain.phases == () and plain.frames[0].fingers["one"].servo_angles is None
    text = recording_to_json(plain)
    assert "phase" not in text and "servo" not in text
    assert recording_from_json(text).phases == ()
    with pytest.raises(InvalidValue, match="servo_angles"):
        moment(servo_angles=[0.1])
    with pytest.raises(InvalidValue, match="phase"):
        Frame(0.0, {}, None, 3)
