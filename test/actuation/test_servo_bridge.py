# SPDX-License-Identifier: Apache-2.0
"""The bridge over simulated servos: it follows within limits, and holds whenever in doubt."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from racks import PERIOD, Bench, joint, rack

from ccr_ros.actuation.driver import BusLost, DriverError
from ccr_ros.actuation.drivers.loopback import LoopbackSettings
from ccr_ros.actuation.faults import FaultCode
from ccr_ros.actuation.rack import ServoRack
from ccr_ros.actuation.states import BridgeSettings, BridgeState, Refused
from ccr_ros.model import InvalidValue

STIFF = LoopbackSettings(spring=400.0, max_speed=100.0)


def faulty(bench, **change):
    """Change the simulated servos and let time pass until the fault."""
    bench.driver.settings = replace(bench.driver.settings, **change)
    bench.until(lambda: bench.bridge.fault)
    return bench.bridge.fault


def held(bench, seconds=1.0):
    """Let time pass; return how far servos and setpoints moved meanwhile."""
    bench.run(1.0)  # whatever lag there was is gone
    angles, setpoints = bench.driver._spools.copy(), np.array(bench.bridge.setpoints)
    bench.run(seconds)
    return np.max(np.abs([bench.driver._spools - angles, bench.bridge.setpoints - setpoints]))


def test_follows_both_ways_through_gear_and_stretch():
    bench = Bench(servos=STIFF).active()
    bench.run(1.5, thumb=0.010, index=0.006)
    np.testing.assert_allclose(bench.pulls, [0.010, 0.006], atol=2e-5)
    # The cable of the index stretches: more is wound than the finger gets.
    wound = -bench.driver._spools[1] * 0.01 / 2.0
    assert wound == pytest.approx(0.006 + bench.driver.tensions[1] / 5e3, abs=2e-5)
    bench.run(1.5, thumb=0.0, index=-0.001)
    np.testing.assert_allclose(bench.pulls, [0.0, -0.001], atol=2e-5)


def test_rates_and_accelerations_of_setpoints_are_kept():
    bench = Bench(servos=STIFF, of=rack(cable_stiffness=math.inf)).active()
    places = [[axis.pull_setpoint for axis in bench.bridge.axes]]
    for target in (0.012, 0.0, 0.008, -0.002):
        for _ in range(25):
            bench.step(thumb=target, index=0.5 * target)
            places.append([axis.pull_setpoint for axis in bench.bridge.axes])
    rates = np.diff(places, axis=0) / PERIOD
    assert np.max(np.abs(rates)) <= 0.02 * (1 + 1e-9)
    assert np.max(np.abs(np.diff(rates, axis=0))) / PERIOD <= 0.1 * (1 + 1e-6)


def test_start_up_moves_nothing_wherever_the_servos_are():
    first = Bench(servos=STIFF).active()
    first.run(1.0, thumb=0.007, index=0.003)
    second = Bench(servos=STIFF)
    second.driver._motors[:] = second.driver._spools[:] = first.driver._spools
    second.driver._setpoints[:] = first.driver._setpoints
    before = second.driver._spools.copy()
    second.active()
    assert second.bridge.state == BridgeState.ACTIVE
    second.run(1.0)
    np.testing.assert_allclose(second.driver._spools, before, atol=1e-5)
    np.testing.assert_allclose(second.pulls, first.pulls, atol=1e-4)
    second.run(0.02, thumb=0.008)  # and the first command starts from there
    assert second.bridge.axes[0].pull_setpoint == pytest.approx(0.007, abs=1e-4)


def test_commands_that_stop_coming_slow_down_and_hold():
    bench = Bench(settings=BridgeSettings(command_timeout=0.1), servos=STIFF).active()
    bench.run(0.4, thumb=0.012)
    axis = bench.bridge.axes[0]
    assert not axis.stale and axis.moving
    bench.run(0.1)
    at_timeout = axis.pull_setpoint
    bench.until(lambda: axis.stale and not axis.moving, 1.0)
    # It took no longer way than from full speed to rest.
    assert at_timeout <= axis.pull_setpoint <= at_timeout + 0.02**2 / 0.2 + 0.02 * PERIOD * 2
    assert axis.pull_setpoint < 0.0119
    assert held(bench) < 1e-6
    assert not bench.bridge.axes[1].stale  # never commanded, it just holds
    bench.run(1.0, thumb=0.012)
    assert not axis.stale
    assert bench.pulls[0] == pytest.approx(0.012, abs=2e-5)


@pytest.mark.parametrize(
    ("pulls", "error", "text"),
    [
        ({0: math.nan}, InvalidValue, "pulls.main: nan"),
        ({0: math.inf}, InvalidValue, "pulls.main: inf"),
        ({0: 0.013}, InvalidValue, r"pulls.main: 0.013 .* -0.002..0.012 \[m\]"),
        ({0: -0.003}, InvalidValue, "pulls.main: -0.003"),
        ({0: 0.001, 1: math.nan}, InvalidValue, "nan"),
    ],
)
def test_bad_commands_move_nothing(pulls, error, text):
    bench = Bench().active()
    bench.run(1.0, thumb=0.002)
    before = bench.bridge.setpoints
    with pytest.raises(error, match=text):
        bench.bridge.command(pulls, bench.now, bench.now)
    bench.run(0.3)
    assert bench.bridge.setpoints == pytest.approx(before, abs=1e-9)


def test_old_commands_and_those_of_the_future_are_refused():
    bench = Bench().active()
    for at, text in ((-0.6, "0.6 s old"), (0.6, "0.6 s ahead of the clock")):
        with pytest.raises(Refused, match=text):
            bench.bridge.command({0: 0.001}, bench.now + at, bench.now)
    bench.bridge.command({0: 0.001}, bench.now - 0.4, bench.now)


def test_a_command_counts_from_its_stamp():
    bench = Bench().active()
    bench.bridge.command({0: 0.012}, bench.now - 0.45, bench.now)
    bench.run(0.1)
    assert bench.bridge.axes[0].stale


def test_without_a_zero_no_command():
    bench = Bench(true_zeros=(0.0, 0.0), zeros={"index_main": 0.0}).active()
    with pytest.raises(DriverError, match="zero of thumb_main is not known; calibrate"):
        bench.command(thumb=0.001)
    bench.command(index=0.001)
    assert math.isnan(bench.pulls[0]) and bench.pulls[1] == pytest.approx(0.0)


def test_stop_acts_within_the_cycle_and_holds_until_reset():
    bench = Bench(servos=STIFF).active()
    bench.run(0.3, thumb=0.012)
    setpoint = bench.bridge.setpoints[0]
    bench.bridge.stop()
    assert bench.driver._setpoints[0] <= setpoint  # written at once, no cycle needed
    assert bench.bridge.state == BridgeState.STOPPED
    with pytest.raises(Refused, match="STOPPED"):
        bench.command(thumb=0.001)
    assert held(bench) < 1e-9
    bench.bridge.reset(bench.now)
    assert bench.bridge.state == BridgeState.ACTIVE
    assert held(bench) < 1e-9  # commands from before are forgotten
    bench.run(1.0, thumb=0.001)
    assert bench.pulls[0] == pytest.approx(0.001, abs=2e-5)


def test_a_grip_keeps_its_force_through_stop_deactivation_and_back():
    bench = Bench(servos=STIFF).active()
    bench.run(1.0, thumb=0.010)
    force = bench.driver.tensions[0]
    steps = (
        bench.bridge.stop,
        lambda: bench.bridge.reset(bench.now),
        bench.bridge.deactivate,
        lambda: bench.bridge.activate(bench.now),
        bench.bridge.close,
    )
    for step in steps:
        step()
        bench.run(0.5)
        assert bench.driver.tensions[0] == pytest.approx(force, rel=0.01)


def test_over_tension():
    soft = ServoRack("soft", (joint(max_tension=3.0), joint("index")))
    bench = Bench(servos=STIFF, of=soft).active()
    bench.until(lambda: bench.bridge.fault, 2.0, **{"thumb": 0.012, "index": 0.012})
    fault = bench.bridge.fault
    assert (fault.code, fault.joint) == (FaultCode.OVER_TENSION, "thumb_main")
    assert held(bench) < 1e-6
    assert bench.driver.tensions[0] == pytest.approx(3.0, rel=0.15)  # held, not dropped
    with pytest.raises(Refused, match="FAULT"):
        bench.command(thumb=0.0)
    # After a reset the cable can be paid out, and not be wound up.
    bench.driver.settings = replace(bench.servos, spring=430.0)
    bench.run(0.5)
    bench.bridge.reset(bench.now)
    pull = bench.pulls[0]
    bench.run(0.5, thumb=0.012)
    assert bench.bridge.fault is None
    assert bench.pulls[0] <= pull + 1e-4
    bench.run(1.0, thumb=0.001)
    assert bench.pulls[0] == pytest.approx(0.001, abs=2e-5)


def test_over_travel():
    bench = Bench(servos=STIFF).active()
    bench.run(1.0, thumb=0.010)
    bench.driver._spools[0] = bench.driver._motors[0] = 1.5  # 15 mm: something turned it
    bench.driver._setpoints[0] = 1.5
    bench.bridge.axes[0].adopt(1.5)
    bench.until(lambda: bench.bridge.fault, 1.0)
    assert bench.bridge.fault.code == FaultCode.OVER_TRAVEL
    assert "travel -2..12 mm" in bench.bridge.fault.reason
    bench.bridge.reset(bench.now)
    bench.run(1.5, thumb=0.011)  # the way back is free
    assert bench.pulls[0] == pytest.approx(0.011, abs=2e-5)
    assert bench.bridge.fault is None


def test_stall():
    bench = Bench(servos=replace(STIFF, noise=1e-3)).active()
    bench.run(0.5, thumb=0.005)
    bench.driver.settings = replace(bench.servos, stalled=("thumb_main",))
    bench.until(lambda: bench.bridge.fault, 3.0, thumb=0.012)
    assert (bench.bridge.fault.code, bench.bridge.fault.joint) == (FaultCode.STALL, "thumb_main")
    lead = bench.bridge.axes[0].pull_setpoint - bench.pulls[0]
    assert 0.0 < lead < 0.0015  # it goes on pushing a little, not for all the way that is left
    bench.driver.settings = replace(bench.servos, stalled=())
    bench.bridge.reset(bench.now)
    bench.run(1.5, thumb=0.012)
    assert bench.pulls[0] == pytest.approx(0.012, abs=1e-4)


def test_temperature():
    bench = Bench(servos=STIFF).active()
    fault = faulty(bench, temperature=75.0)
    assert fault.code == FaultCode.TEMPERATURE
    assert held(bench) < 1e-9
    with pytest.raises(Refused, match="TEMPERATURE: 75 degC, limit 70 degC"):
        bench.bridge.reset(bench.now)
    assert bench.bridge.state == BridgeState.FAULT
    bench.driver.settings = bench.servos
    bench.run(0.1)
    bench.bridge.reset(bench.now)
    assert bench.bridge.state == BridgeState.ACTIVE


def test_lost_bus():
    bench = Bench(servos=STIFF).active()
    bench.run(0.5, thumb=0.008)
    bench.driver.settings = replace(bench.servos, dropout=True)
    bench.run(0.1, thumb=0.008)
    assert bench.bridge.fault is None  # a short one is borne
    bench.driver.settings = bench.servos
    bench.run(0.5, thumb=0.008)
    fault = faulty(bench, dropout=True)
    assert (fault.code, fault.joint) == (FaultCode.BUS_LOST, "")
    with pytest.raises(Refused, match="BUS_LOST: the simulated bus is dead"):
        bench.bridge.reset(bench.now)
    bench.driver.settings = bench.servos
    assert held(bench) < 1e-9  # it comes back by itself, and holds until reset
    assert bench.bridge.state == BridgeState.FAULT
    bench.bridge.reset(bench.now)
    assert held(bench) < 1e-6
    bench.run(1.0, thumb=0.0)
    assert bench.pulls[0] == pytest.approx(0.0, abs=2e-5)


def test_servos_that_can_be_read_and_not_written_are_lost_too():
    bench = Bench(servos=STIFF).active()

    def lost(angles):
        raise BusLost("the wire is cut")

    write, bench.driver.write = bench.driver.write, lost
    bench.until(lambda: bench.bridge.fault, 1.0)
    assert (bench.bridge.fault.code, bench.bridge.fault.reason) == (
        FaultCode.BUS_LOST,
        "the wire is cut",
    )
    bench.driver.write = write
    bench.bridge.reset(bench.now)
    bench.run(1.0, thumb=0.002)
    assert bench.pulls[0] == pytest.approx(0.002, abs=2e-5)


def test_what_a_servo_reports_itself_is_a_fault():
    bench = Bench(servos=STIFF).active()
    read = bench.driver.read
    bench.driver.read = lambda now: replace(read(now), errors=("", "overload"))
    bench.until(lambda: bench.bridge.fault, 1.0)
    assert bench.bridge.fault.code == FaultCode.SERVO_ERROR
    assert (bench.bridge.fault.joint, bench.bridge.fault.reason) == ("index_main", "overload")
    with pytest.raises(Refused, match="index_main: SERVO_ERROR: overload"):
        bench.bridge.reset(bench.now)


def test_a_fault_outlives_deactivation():
    bench = Bench(servos=STIFF).active()
    faulty(bench, temperature=75.0)
    bench.bridge.deactivate()
    assert bench.bridge.state == BridgeState.FAULT
    with pytest.raises(Refused, match="reset first"):
        bench.bridge.activate(bench.now)
    bench.driver.settings = bench.servos
    bench.run(0.1)
    bench.bridge.reset(bench.now)
    assert bench.bridge.state == BridgeState.INACTIVE


def test_before_activation_nothing_is_written_and_a_silent_bus_is_waited_for():
    bench = Bench(servos=replace(STIFF, dropout=True))
    written = []
    bench.driver.write = written.append
    bench.run(1.0)
    assert bench.bridge.state == BridgeState.INACTIVE and bench.bridge.measured_at is None
    assert "bus is dead" in bench.bridge.reason
    with pytest.raises(BusLost):
        bench.bridge.activate(bench.now)
    bench.driver.settings = STIFF
    bench.run(0.1)
    bench.bridge.stop()
    bench.run(0.1)
    bench.bridge.reset(bench.now)
    assert bench.bridge.state == BridgeState.INACTIVE and bench.bridge.reason == ""
    assert written == []


def test_a_clock_that_is_set_back_holds():
    bench = Bench(servos=STIFF).active()
    bench.run(0.3, thumb=0.012)
    bench.now -= 50.0
    bench.run(0.5)
    assert bench.bridge.axes[0].stale and held(bench) < 1e-6
    bench.run(1.5, thumb=0.012)
    assert bench.pulls[0] == pytest.approx(0.012, abs=2e-5)


def test_a_late_cycle_makes_no_leap():
    bench = Bench(settings=BridgeSettings(command_timeout=60.0), servos=STIFF).active()
    bench.run(0.4, thumb=0.012)
    before = bench.bridge.axes[0].pull_setpoint
    bench.now += 5.0
    bench.step()
    assert bench.bridge.axes[0].pull_setpoint - before <= 0.02 * 0.1 + 1e-9


EVENTS = st.one_of(
    st.tuples(st.just("command"), st.floats(-0.002, 0.012), st.floats(-0.002, 0.012)),
    st.tuples(st.just("wait"), st.integers(1, 60), st.none()),
    st.tuples(
        st.sampled_from(["stop", "reset", "deactivate", "activate", "calibrate"]),
        st.none(),
        st.none(),
    ),
    st.tuples(
        st.just("change"),
        st.sampled_from(["dropout", "stalled", "hot", "none"]),
        st.none(),
    ),
)


@settings(max_examples=40)
@given(st.lists(EVENTS, min_size=1, max_size=25))
def test_no_sequence_of_events_makes_a_setpoint_leap_or_moves_what_must_hold(events):
    """Whatever happens, setpoints move within rates, and only in ACTIVE and CALIBRATING."""
    bench = Bench(servos=STIFF).active()
    changes = {
        "dropout": {"dropout": True},
        "stalled": {"stalled": ("thumb_main",)},
        "hot": {"temperature": 80.0},
        "none": {},
    }
    # One cycle at the largest rate, and the tolerance that a hold may take back.
    leap = np.array([1.0, 2.0]) / 0.01 * (0.02 * PERIOD + 0.001 + 2e-4)
    near = np.array([1.0, 2.0]) / 0.01 * 0.001 * (1 + 1e-9)

    def step():
        before, state = np.array(bench.driver._setpoints), bench.bridge.state
        bench.step()
        moved = np.abs(bench.driver._setpoints - before)
        # A setpoint far ahead of a servo that stalls comes back to where the servo is.
        back = np.abs(bench.driver._setpoints - bench.driver._spools) <= near
        assert np.all((moved <= leap) | back)
        if state not in (BridgeState.ACTIVE, BridgeState.CALIBRATING):
            assert np.all(moved < 1e-12)

    for kind, one, two in events:
        try:
            if kind == "command":
                bench.command(thumb=one, index=two)
            elif kind == "change":
                bench.driver.settings = replace(STIFF, **changes[one])
            elif kind == "calibrate":
                bench.bridge.calibrate([], lambda *_: None)
            elif kind in ("reset", "activate"):
                before = bench.driver._setpoints.copy()
                getattr(bench.bridge, kind)(bench.now)
                assert np.all(bench.driver._setpoints == before)
            elif kind in ("stop", "deactivate"):
                getattr(bench.bridge, kind)()
        except (Refused, BusLost, DriverError, InvalidValue):
            pass
        for _ in range(one if kind == "wait" else 1):
            step()
    assert np.all(np.isfinite(bench.driver._setpoints))
