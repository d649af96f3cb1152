# SPDX-License-Identifier: Apache-2.0
"""The Dynamixel driver against servos simulated behind a pseudo terminal."""

import math
import sys
from dataclasses import replace

import numpy as np
import pytest
from dynamixel_servos import (
    GOAL,
    GOAL_CURRENT,
    HARDWARE_ERROR,
    MODE,
    POSITION,
    RESULT_FAIL,
    TEMPERATURE,
    TORQUE,
    VELOCITY,
    WATCHDOG,
    DynamixelServos,
    crc,
    packet,
)
from racks import rack

pytest.importorskip("dynamixel_sdk")

from ccr_ros.actuation.bridge import ServoBridge
from ccr_ros.actuation.driver import BusLost, DriverError
from ccr_ros.actuation.drivers.dynamixel import DynamixelDriver
from ccr_ros.actuation.faults import FaultCode
from ccr_ros.actuation.rack import ServoRack
from ccr_ros.actuation.states import BridgeSettings, BridgeState, Refused
from ccr_ros.model import InvalidValue

COUNT = 2 * math.pi / 4096  # rad
PAIR = ServoRack(
    "pair",
    tuple(
        replace(joint, id=servo, current_limit=limit, torque_constant=torque)
        for joint, servo, limit, torque in zip(
            rack().joints, (1, 7), (0.5, None), (2.0, None), strict=True
        )
    ),
)


@pytest.fixture(autouse=True)
def patience(monkeypatch):
    """Let servos be late on a busy machine; return how to be less patient where one is silent."""

    def wait(milliseconds):
        monkeypatch.setattr("dynamixel_sdk.port_handler.LATENCY_TIMER", milliseconds / 2)

    wait(5000)
    return lambda: wait(300)


@pytest.fixture
def servos():
    servos = DynamixelServos(1, 7)
    yield servos
    servos.close()


@pytest.fixture
def driver(servos):
    made = DynamixelDriver(PAIR, servos.port, 1000000, 0.0, 0.00269)
    yield made
    made.close()


def test_the_simulation_keeps_to_the_manual():
    # The examples of the protocol 2.0 manual: ping of 1, and its answer.
    assert packet(1, 0x01, b"") == bytes.fromhex("fffffd00010300 01 194e")
    answer = bytes.fromhex("fffffd00010700 55 00 0604 26 655d")
    assert crc(answer[:-2]) == int.from_bytes(answer[-2:], "little")


def test_start_up_moves_nothing(servos, driver):
    servos[7].put(POSITION, -5000)
    driver.open()
    assert servos[1].get(TORQUE) == 0 and servos[1].get(MODE) == 3  # nothing is written yet
    held = driver.enable(0.0)
    assert held == pytest.approx((2048 * COUNT, -5000 * COUNT))
    assert [servos[i].get(POSITION) for i in (1, 7)] == [2048, -5000]
    assert [servos[i].get(TORQUE) for i in (1, 7)] == [1, 1]
    # Within a current where there is a limit; both modes count turns.
    assert [servos[i].get(MODE) for i in (1, 7)] == [5, 4]
    assert servos[1].get(GOAL_CURRENT) == round(0.5 / 0.00269)
    assert servos[7].get(GOAL_CURRENT) == 1193


def test_reads_and_writes(servos, driver):
    driver.open()
    driver.enable(0.0)
    # Bytes that look like a header within a packet, too.
    for angle in (0.5, -3.0, 0xFDFFFF * COUNT, -0x020001 * COUNT):
        driver.write([angle, -angle])
        reading = driver.read(0.0)
        np.testing.assert_allclose(reading.angles, [angle, -angle], atol=COUNT)
    servos[1].put(126, -100)
    servos[1].put(VELOCITY, 10)
    servos[7].put(TEMPERATURE, 55)
    reading = driver.read(0.1)
    assert reading.efforts.tolist() == pytest.approx([-0.538, math.nan], nan_ok=True)
    assert reading.velocities[0] == pytest.approx(10 * 0.229 * 2 * math.pi / 60)
    assert reading.temperatures.tolist() == [30.0, 55.0]
    assert reading.errors == ("", "")
    assert servos.bad_crcs == 0


def test_a_servo_that_holds_already_keeps_its_goal(servos, driver):
    for servo, mode in ((1, 5), (7, 4)):
        servos[servo].put(MODE, mode)
        servos[servo].put(TORQUE, 1)
        servos[servo].put(GOAL, 2060)  # 12 counts ahead of it: that is what it pulls with
    driver.open()
    assert driver.enable(0.0) == pytest.approx((2060 * COUNT,) * 2)
    assert servos[1].goals == [2060]


def test_torque_is_never_switched_off(servos, driver):
    servos[1].put(TORQUE, 1)  # it holds, and in a mode that does not count turns
    with pytest.raises(DriverError, match=r"servo 1 \(thumb_main\) holds in operating mode 3"):
        driver.open()
    servos[1].put(TORQUE, 0)
    driver.open()
    driver.enable(0.0)
    driver.write([1.0, 1.0])
    driver.recover()
    driver.enable(0.0)
    driver.hold()
    driver.close()
    assert [servos[i].get(TORQUE) for i in (1, 7)] == [1, 1]
    assert [servos[i].lowered for i in (1, 7)] == [0, 0]


@pytest.mark.parametrize("servo", [1, 7])
def test_a_servo_that_falls_silent_is_named(servos, driver, servo, patience):
    driver.open()
    driver.enable(0.0)
    servos[servo].mute = True
    patience()
    with pytest.raises(BusLost, match=rf"servo {servo} at .*There is no status packet"):
        driver.read(1.0)
    driver.write([0.0, 0.0])  # nobody confirms it, so nothing is amiss
    servos[servo].mute = False
    driver.read(2.0)


def test_a_servo_that_is_not_there(servos, patience):
    patience()
    lonely = ServoRack("one", (replace(PAIR.joints[0], id=3),))
    driver = DynamixelDriver(lonely, servos.port, 1000000, 0.0, 0.00269)
    with pytest.raises(BusLost, match=r"servo 3 at .*does not answer"):
        driver.open()
    driver.close()


def test_a_broken_checksum_is_a_lost_answer(servos, driver, patience):
    driver.open()
    driver.enable(0.0)
    servos[7].corrupt = 1
    patience()
    with pytest.raises(BusLost, match=r"servo 7 at .*Incorrect status packet"):
        driver.read(1.0)
    assert driver.read(1.02).errors == ("", "")


def test_a_servo_that_refuses_says_so(servos, driver):
    driver.open()
    servos[1].failing = RESULT_FAIL
    with pytest.raises(DriverError, match=r"servo 1 at .*: Failed to process"):
        driver.enable(0.0)


def test_hardware_errors_are_put_into_words(servos, driver):
    driver.open()
    driver.enable(0.0)
    assert driver.read(0.0).errors == ("", "")
    servos[7].put(HARDWARE_ERROR, 0b100100)
    assert driver.read(0.1).errors == ("", "")  # looked at twice a second
    assert driver.read(0.6).errors == ("", "overheating, overload")


def test_a_servo_that_gave_up_is_restarted_but_not_one_that_holds(servos, driver):
    driver.open()
    driver.enable(0.0)
    driver.write([1.0, 1.0])
    servos[7].put(HARDWARE_ERROR, 0b100000)
    with pytest.raises(DriverError, match=r"servo 7 .*still holds with overload"):
        driver.recover()
    assert servos[7].reboots == 0
    servos[7].put(TORQUE, 0)  # it shut itself down
    assert "overload; its torque is off" in driver.read(1.0).errors[1]
    driver.recover()
    held = driver.enable(2.0)
    assert (servos[1].reboots, servos[7].reboots) == (0, 1)
    assert held == pytest.approx((1.0, 1.0), abs=COUNT)
    assert servos[7].get(TORQUE) == 1
    assert driver.read(2.0).errors == ("", "")


def test_lost_power_is_told(servos, driver):
    driver.open()
    driver.enable(0.0)
    servos[1].restart()
    assert "its torque is off: it shut itself down, or lost its power" in driver.read(1.0).errors[0]


def test_the_watchdog(servos):
    driver = DynamixelDriver(PAIR, servos.port, 1000000, 0.1, 0.00269)
    driver.open()
    driver.enable(0.0)
    assert [servos[i].get(WATCHDOG) for i in (1, 7)] == [5, 5]
    servos[1].put(POSITION, 2000)
    servos[1].put(GOAL, 4000)
    servos.now += 0.3  # the bus is silent for longer than that
    assert "it stopped, as the bus was silent" in driver.read(1.0).errors[0]
    driver.write([2.0, 2.0])
    assert servos[1].get(POSITION) == 2000  # it does not follow
    held = driver.enable(2.0)
    # It does not go on to where it was sent then; no farther than the tolerance of 1 mm.
    assert held[0] == pytest.approx(2000 * COUNT + 0.1, abs=COUNT)
    assert driver.read(2.0).errors == ("", "")
    driver.hold()
    servos.now += 0.3
    assert [servos[i].get(WATCHDOG) for i in (1, 7)] == [0, 0]
    assert driver.read(3.0).errors == ("", "")  # silence was no alarm any more
    driver.close()


def test_an_adapter_that_is_pulled(servos, driver):
    driver.open()
    driver.enable(0.0)
    servos.close()
    with pytest.raises(BusLost, match="/dev/pts"):
        driver.read(1.0)
    with pytest.raises(BusLost, match="/dev/pts"):
        driver.write([0.0, 0.0])
    with pytest.raises(BusLost, match="cannot be opened"):
        driver.recover()
    with pytest.raises(BusLost, match="is not open"):
        driver.read(2.0)


def test_no_port():
    driver = DynamixelDriver(PAIR, "/dev/no_such_port", 1000000, 0.0, 0.00269)
    with pytest.raises(BusLost, match="/dev/no_such_port cannot be opened"):
        driver.open()


def test_a_rack_without_ids():
    with pytest.raises(InvalidValue, match=r"thumb_main\.id: None"):
        DynamixelDriver(rack(), "/dev/null", 1000000, 0.0, 0.00269)


def test_without_the_sdk(monkeypatch):
    monkeypatch.setitem(sys.modules, "dynamixel_sdk", None)
    with pytest.raises(DriverError, match=r"ccr_ros\[dynamixel\]"):
        DynamixelDriver(PAIR, "/dev/null", 1000000, 0.0, 0.00269)


def test_a_bridge_over_the_bus(servos, driver, patience):
    driver.open()
    zeros = {"thumb_main": 2048 * COUNT, "index_main": 2048 * COUNT}
    bridge = ServoBridge(driver, BridgeSettings(), zeros, lambda _: None)
    bridge.cycle(0.0)
    bridge.activate(0.0)
    now = 0.0
    for _ in range(60):
        now += 0.02
        bridge.command({0: 0.010, 1: 0.004}, now, now)
        bridge.cycle(now)
    bridge.cycle(now)
    assert [axis.pull for axis in bridge.axes] == pytest.approx([0.010, 0.004], abs=2e-5)
    assert servos[1].get(POSITION) == pytest.approx(2048 + 1.0 / COUNT, abs=1)
    assert servos[7].get(POSITION) == pytest.approx(2048 - 0.8 / COUNT, abs=1)

    servos[7].mute = True
    patience()
    for _ in range(3):
        now += 0.15
        bridge.cycle(now)
    assert bridge.fault.code == FaultCode.BUS_LOST and "servo 7" in bridge.fault.reason
    with pytest.raises(Refused, match="servo 7"):
        bridge.reset(now)
    servos[7].mute = False
    bridge.reset(now)
    assert bridge.state == BridgeState.ACTIVE

    servos[1].put(HARDWARE_ERROR, 0b100)
    for _ in range(40):
        now += 0.02
        bridge.cycle(now)
    assert (bridge.fault.code, bridge.fault.reason) == (FaultCode.SERVO_ERROR, "overheating")
    goals = [servos[i].get(GOAL) for i in (1, 7)]
    bridge.close()
    assert [servos[i].get(GOAL) for i in (1, 7)] == goals
    assert [servos[i].get(TORQUE) for i in (1, 7)] == [1, 1]
