# SPDX-License-Identifier: Apache-2.0
"""Calibration finds the zeros of simulated racks that know better, and fails in words."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from racks import Bench, joint

from ccr_ros.actuation.calibrator import CalibrationSettings, Calibrator
from ccr_ros.actuation.drivers.loopback import LoopbackSettings
from ccr_ros.actuation.faults import FaultCode
from ccr_ros.actuation.rack import ServoRack
from ccr_ros.actuation.states import BridgeSettings, BridgeState, Refused
from ccr_ros.actuation.zeros import load_zeros
from ccr_ros.model import InvalidFile, UnknownName

QUICK = BridgeSettings(calibration=CalibrationSettings(rate=0.02))


def calibrated(bench, joints=()):
    """Calibrate; return the zeros and what failed."""
    told = []
    bench.bridge.calibrate(list(joints), lambda *answer: told.append(answer))
    assert bench.bridge.state == BridgeState.CALIBRATING
    return bench.until(lambda: told and told[0])


def mm_off(bench, zeros, true_zeros):
    return [
        1e3 * abs(zeros[joint.name] - true) * joint.spool_radius / joint.gear
        for joint, true in zip(bench.rack.joints, true_zeros, strict=True)
    ]


@settings(max_examples=10)
@given(
    st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)),
    st.floats(100.0, 1000.0),
)
def test_zeros_are_found_from_slack_and_from_taut(true_zeros, stiffness):
    slow = BridgeSettings(calibration=CalibrationSettings(rate=0.01))
    bench = Bench(slow, LoopbackSettings(spring=stiffness), true_zeros).active()
    assert not any(axis.calibrated for axis in bench.bridge.axes)
    zeros, failure = calibrated(bench)
    assert not failure
    assert max(mm_off(bench, zeros, true_zeros)) < 0.05
    assert bench.stored == [zeros]
    assert bench.bridge.state == BridgeState.ACTIVE
    bench.run(1.0)
    np.testing.assert_allclose(bench.pulls, 0.0, atol=1e-4)
    bench.run(1.0, thumb=0.005, index=0.002)  # now commands are taken
    np.testing.assert_allclose(bench.pulls, [0.005, 0.002], atol=1e-4)


def test_noise_backlash_and_a_crooked_effort_do_not_spoil_it():
    servos = LoopbackSettings(spring=400.0, noise=0.002, effort_noise=0.0005, backlash=0.01)
    bench = Bench(BridgeSettings(), servos, (0.3, -0.4)).active()
    zeros, failure = calibrated(bench)
    assert not failure
    assert max(mm_off(bench, zeros, (0.3, -0.4))) < 0.3


def test_efforts_that_are_told_late_shift_no_zero():
    bench = Bench(QUICK, LoopbackSettings(spring=400.0), (0.3, -0.4)).active()
    read, late = bench.driver.read, []

    def told_late(now):
        reading = read(now)
        late.append(reading.efforts)
        return replace(reading, efforts=late[max(0, len(late) - 6)])  # 0.1 s, or 2 mm

    bench.driver.read = told_late
    zeros, failure = calibrated(bench)
    assert not failure
    assert max(mm_off(bench, zeros, (0.3, -0.4))) < 0.3


def test_the_offset_is_the_pull_where_it_was_found():
    offset = ServoRack("one", (joint(offset=0.001),))
    bench = Bench(QUICK, LoopbackSettings(spring=400.0), (0.2,), of=offset).active()
    zeros, _ = calibrated(bench)
    assert max(mm_off(bench, zeros, (0.2,))) < 0.05
    bench.run(0.5)
    assert bench.pulls == pytest.approx([0.001], abs=1e-4)


def test_only_the_joints_asked_for_move_and_change():
    bench = Bench(QUICK, LoopbackSettings(spring=400.0), (0.3, -0.4)).active()
    before = bench.driver.read(bench.now).angles[0]
    zeros, failure = calibrated(bench, ["index_main"])
    assert not failure and list(zeros) == ["index_main"]
    assert bench.driver.read(bench.now).angles[0] == before
    assert [axis.calibrated for axis in bench.bridge.axes] == [False, True]


def test_zeros_are_stored_and_come_back(tmp_path):
    path = tmp_path / "zeros.yaml"
    first = Bench(QUICK, LoopbackSettings(spring=400.0), (0.3, -0.4), store=path).active()
    zeros, _ = calibrated(first)
    assert load_zeros(path, first.rack, "loopback") == zeros
    again = Bench(QUICK, LoopbackSettings(spring=400.0), (0.3, -0.4), store=path)
    assert again.bridge.zeros == zeros


def test_what_cannot_be_stored_changes_nothing():
    bench = Bench(QUICK, LoopbackSettings(spring=400.0), (0.3, -0.4)).active()

    def full(zeros):
        raise InvalidFile("zeros.yaml", "cannot be written: No space left on device")

    bench.bridge._store = full
    zeros, failure = calibrated(bench)
    assert zeros == {} and "No space left" in failure
    assert not any(axis.calibrated for axis in bench.bridge.axes)
    assert bench.bridge.state == BridgeState.ACTIVE


@pytest.mark.parametrize(
    ("servos", "text"),
    [
        (LoopbackSettings(spring=1e-6), "no tension after 30 mm were wound"),
        (LoopbackSettings(spring=0.0), "the tension is not known"),
    ],
)
def test_failures_say_why(servos, text):
    bench = Bench(QUICK, servos, (0.3, -0.4)).active()
    zeros, failure = calibrated(bench)
    assert zeros == {}
    assert failure.startswith("thumb_main: ") and text in failure
    assert bench.bridge.state == BridgeState.ACTIVE
    assert text in bench.bridge.reason


def test_a_tension_that_never_ends_is_no_zero():
    # Taut over more than the search: 60 mm of cable are wound already.
    far = CalibrationSettings(rate=0.02, search=0.01)
    bench = Bench(BridgeSettings(calibration=far), LoopbackSettings(spring=50.0), (-6.0, 0.0))
    zeros, failure = calibrated(bench.active(), ["thumb_main"])
    assert zeros == {} and "still falls after 10 mm" in failure


@pytest.mark.parametrize(
    ("change", "code"),
    [
        ({"stalled": ("thumb_main",)}, FaultCode.STALL),
        ({"temperature": 90.0}, FaultCode.TEMPERATURE),
        ({"dropout": True}, FaultCode.BUS_LOST),
    ],
)
def test_a_fault_ends_it(change, code):
    bench = Bench(QUICK, LoopbackSettings(spring=400.0), (0.3, -0.4)).active()
    told = []
    bench.bridge.calibrate([], lambda *answer: told.append(answer))
    bench.run(0.1)
    bench.driver.settings = replace(bench.servos, **change)
    bench.until(lambda: told)
    assert bench.bridge.fault.code == code
    assert told[0][0] == {} and told[0][1]
    assert not any(axis.calibrated for axis in bench.bridge.axes)


def test_stop_and_deactivation_end_it():
    for end, state in (("stop", BridgeState.STOPPED), ("deactivate", BridgeState.INACTIVE)):
        bench = Bench(QUICK, LoopbackSettings(spring=400.0), (0.3, -0.4)).active()
        told = []
        bench.bridge.calibrate([], lambda *answer, told=told: told.append(answer))
        bench.run(0.1)
        getattr(bench.bridge, end)()
        assert told and bench.bridge.state == state
        bench.run(0.5)
        held = bench.driver.read(bench.now).angles.copy()
        bench.run(0.5)
        np.testing.assert_allclose(bench.driver.read(bench.now).angles, held, atol=1e-5)


def test_what_holds_something_is_not_let_go():
    bench = Bench().active()
    bench.run(1.0, thumb=0.005)
    assert bench.bridge.axes[0].tension > 1.0
    with pytest.raises(Refused, match=r"thumb_main is pulled by 5 mm with 2 N"):
        bench.bridge.calibrate([], lambda *_: None)
    assert bench.bridge.state == BridgeState.ACTIVE
    with pytest.raises(UnknownName, match="thumb_tip"):
        bench.bridge.calibrate(["thumb_tip"], lambda *_: None)


def test_only_an_active_bridge_calibrates():
    bench = Bench()
    with pytest.raises(Refused, match="INACTIVE"):
        bench.bridge.calibrate([], lambda *_: None)
    bench.active()
    bench.bridge.calibrate([], lambda *_: None)
    with pytest.raises(Refused, match="CALIBRATING"):
        bench.bridge.calibrate([], lambda *_: None)
    with pytest.raises(Refused, match="CALIBRATING"):
        bench.command(thumb=0.001)


def test_efforts_that_are_told_seldom_lead_no_farther_than_what_was_wound():
    """A line along a step has no slope but that of rounding, and would end anywhere."""
    calibrator = Calibrator([], CalibrationSettings())
    calibrator._ground = 0.0
    wound = np.linspace(0.0, 0.002, 21)
    tensions = np.where(wound < 0.0009, 0.0, 0.1)
    tensions[10:19] += np.linspace(0.0, 1e-9, 9)  # as good as level
    tensions[-1] = 0.34
    assert -0.002 <= calibrator._taut(np.column_stack([wound, tensions])) <= 0.002
