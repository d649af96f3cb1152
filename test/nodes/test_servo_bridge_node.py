# SPDX-License-Identifier: Apache-2.0
"""The servo bridge with simulated servos, through its topics and services."""

import math

import pytest
from builtin_interfaces.msg import Time
from ccr_msgs.msg import CablePulls, FingerState, ServoState
from ccr_msgs.srv import Calibrate
from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

from ccr_ros.nodes.qos import LATCHED

SPRING = {"loopback__spring": 400.0}


def set_live(node, **values):
    """Set parameters while the node runs, as others would."""
    for result in node.set_parameters(
        [Parameter(name.replace("__", "."), value=value) for name, value in values.items()]
    ):
        assert result.successful, result.reason


def test_starts_by_itself_and_tells_its_state(servos, start_bridge):
    start_bridge(**SPRING)
    state = servos.in_state(ServoState.ACTIVE)
    assert (state.driver, state.fault, state.joint, state.reason) == ("loopback", 0, "", "")
    assert [j.name for j in state.joints] == [f"finger_{i}_main" for i in (1, 2, 3)]
    joint = state.joints[1]
    assert (joint.finger, joint.cable, joint.calibrated) == ("finger_2", "main", True)
    assert (joint.pull, joint.tension, joint.temperature) == (0.0, 0.0, 25.0)
    assert math.isnan(joint.pull_commanded) and not joint.moving and not joint.stale


def test_commands_are_followed_and_pulls_measured(servos, probe, start_bridge):
    start_bridge(**SPRING)
    servos.in_state(ServoState.ACTIVE)
    joints = probe.listen(JointState, "joint_states", latched=False)
    commands = probe.listen(Float64MultiArray, "servo_commands", latched=False)
    pulls = servos.pulls("finger_2")
    servos.lead_to("finger_2", 0.006)
    probe.until(lambda: pulls and abs(pulls[-1].pulls[0] - 0.006) < 1e-4)
    assert pulls[-1].names == ["main"]
    assert servos.joint("finger_1_main").pull == pytest.approx(0.0, abs=1e-9)
    assert servos.joint("finger_2_main").pull_commanded == 0.006
    assert servos.joint("finger_2_main").tension == pytest.approx(2.4, rel=0.06)

    newest = probe.until(lambda: joints and joints[-1])
    assert newest.name == [f"finger_{i}_main" for i in (1, 2, 3)]
    assert newest.position[1] == pytest.approx(0.6, rel=0.05)  # 6 mm on a spool of 10 mm
    assert newest.effort[1] == pytest.approx(2.4 * 0.01, rel=0.05)
    assert newest.velocity[0] == 0.0
    assert commands[-1].data[1] == pytest.approx(0.6, rel=0.05)
    # Each message is of its own time, later than the one before.
    stamps = [(m.header.stamp.sec, m.header.stamp.nanosec) for m in pulls]
    assert stamps[0][0] > 0 and sorted(set(stamps)) == stamps


def test_names_may_be_given_and_other_cables_keep_their_command(servos, start_bridge, small_rack):
    start_bridge(**small_rack, **SPRING)
    servos.in_state(ServoState.ACTIVE)

    def at(straight, helical):
        found = [servos.joint(f"thumb_{cable}").pull for cable in ("straight", "helical")]
        return found == pytest.approx([straight, helical], abs=1e-4)

    servos.lead(lambda: at(0.002, 0.004), thumb=[0.002, 0.004])
    servos.command("thumb", [0.001], ("helical",))
    servos.probe.until(lambda: at(0.002, 0.001))
    assert servos.joint("thumb_straight").pull_commanded == 0.002


BAD = {
    "nan": (CablePulls(pulls=[math.nan]), "pulls.main: nan"),
    "beyond travel": (CablePulls(pulls=[0.02]), "pulls.main: 0.02"),
    "count": (CablePulls(pulls=[0.001, 0.001]), "one per cable: main"),
    "none": (CablePulls(), "1 numbers"),
    "another finger's": (CablePulls(names=["straight"], pulls=[0.001]), "unknown cable 'straight'"),
    "twice": (CablePulls(names=["main"] * 2, pulls=[0.001] * 2), "names: 'main'"),
    "names without pulls": (CablePulls(names=["main"]), "one per name"),
    "old": (CablePulls(pulls=[0.001]), "s old"),
}


def test_bad_commands_are_refused_with_a_warning_and_move_nothing(servos, probe, start_bridge):
    start_bridge(**SPRING)
    servos.in_state(ServoState.ACTIVE)
    servos.lead_to("finger_1", 0.003)
    probe.diagnostics()
    BAD["old"][0].header.stamp = Time(sec=1000)
    for case, (message, text) in BAD.items():
        probe.publish("finger_1/cable_pull_commands", message)

        def told(text=text):
            status = probe.status(": servos")
            return status and status.level == DiagnosticStatus.WARN and text in status.message

        probe.until(told, f"the refusal of {case!r}")
        assert servos.joint("finger_1_main").pull == pytest.approx(0.003, abs=2e-4), case
    assert servos.still("finger_1") < 2e-4
    servos.lead_to("finger_1", 0.001)


def test_commands_that_stop_coming_hold(servos, start_bridge):
    start_bridge(**SPRING, command_timeout=0.1)
    servos.in_state(ServoState.ACTIVE)
    servos.lead(lambda: servos.joint("finger_1_main").pull > 0.002, finger_1=[0.012])
    servos.probe.until(lambda: servos.joint("finger_1_main").stale, "it is stale")
    servos.probe.until(lambda: not servos.joint("finger_1_main").moving, "it stands")
    assert servos.joint("finger_1_main").pull_setpoint < 0.0119
    servos.probe.spin_for(0.3)
    assert servos.still("finger_1") < 1e-5


def test_stop_and_reset(servos, start_bridge):
    start_bridge(**SPRING)
    servos.in_state(ServoState.ACTIVE)
    servos.lead(lambda: servos.joint("finger_1_main").pull > 0.002, finger_1=[0.012])
    answer = servos.trigger("stop")
    assert answer.success and "reset" in answer.message
    state = servos.in_state(ServoState.STOPPED)
    assert state.reason == "stopped on request"
    servos.command("finger_1", [0.0])
    servos.probe.spin_for(0.3)
    assert servos.still("finger_1") < 1e-5
    assert servos.joint("finger_1_main").pull > 0.001  # it was not let go
    assert servos.trigger("reset").success
    servos.in_state(ServoState.ACTIVE)
    assert servos.still("finger_1") < 1e-5
    servos.lead_to("finger_1", 0.001)


@pytest.mark.parametrize(
    ("change", "back", "fault", "joint"),
    [
        ({"loopback__spring": 2500.0}, {}, ServoState.OVER_TENSION, "finger_1_main"),
        (
            {"loopback__stalled": "finger_3_main, finger_1_main"},
            {"loopback__stalled": ""},
            ServoState.STALL,
            "finger_1_main",
        ),
        (
            {"loopback__temperature": 80.0},
            {"loopback__temperature": 30.0},
            ServoState.TEMPERATURE,
            "finger_1_main",
        ),
        ({"loopback__dropout": True}, {"loopback__dropout": False}, ServoState.BUS_LOST, ""),
    ],
)
def test_faults_hold_tell_and_need_a_reset(servos, probe, start_bridge, change, back, fault, joint):
    node = start_bridge(**SPRING)
    servos.in_state(ServoState.ACTIVE)
    servos.lead_to("finger_1", 0.006)
    probe.diagnostics()
    set_live(node, **change)
    servos.lead(lambda: servos.state.state == ServoState.FAULT, finger_1=[0.011])
    state = servos.state
    assert (state.fault, state.joint) == (fault, joint)
    assert state.reason
    status = probe.until(
        lambda: (s := probe.status(": servos")) and s.level == DiagnosticStatus.ERROR and s
    )
    assert state.reason in status.message
    if not back:
        assert servos.trigger("reset").success  # and from there it may only let out
    else:
        if fault != ServoState.STALL:  # its cause shows only when it is to move again
            answer = servos.trigger("reset")
            assert not answer.success and answer.message
        set_live(node, **back)
        probe.spin_for(0.2)
        assert servos.state.state == ServoState.FAULT or fault == ServoState.STALL
        assert servos.joint("finger_1_main").pull > 0.005
        assert servos.trigger("reset").success
    servos.in_state(ServoState.ACTIVE)
    assert servos.state.fault == ServoState.NO_FAULT
    servos.lead_to("finger_1", 0.002)


def test_calibration(servos, start_bridge, tmp_path):
    node = start_bridge(**SPRING, calibration__rate=0.02)
    servos.in_state(ServoState.ACTIVE)
    answer = servos.calibrate("finger_2_main")
    assert answer.success and list(answer.joints) == ["finger_2_main"]
    assert answer.zeros[0] == pytest.approx(0.0, abs=0.01)
    assert ServoState.CALIBRATING in {state.state for state in servos.states}
    assert "finger_2_main" in (tmp_path / "zeros.yaml").read_text()
    answer = servos.calibrate("finger_9_main")
    assert not answer.success and "unknown joint 'finger_9_main'" in answer.message
    set_live(node, loopback__stalled="finger_1_main")
    answer = servos.calibrate()
    assert not answer.success and "finger_1_main: no progress" in answer.message
    assert servos.in_state(ServoState.FAULT).fault == ServoState.STALL


def test_stop_ends_a_calibration(servos, probe, start_bridge):
    start_bridge(**SPRING, calibration__rate=0.001)
    servos.in_state(ServoState.ACTIVE)
    client = probe.node.create_client(Calibrate, "servo_bridge_node/calibrate")
    assert client.wait_for_service(60)
    future = client.call_async(Calibrate.Request())
    servos.in_state(ServoState.CALIBRATING)
    assert servos.trigger("stop").success
    probe.until(future.done)
    assert not future.result().success and "stopped" in future.result().message


def test_efforts_come_from_the_solver(servos, probe, start, start_bridge):
    start()
    start_bridge(calibration__rate=0.001)
    servos.in_state(ServoState.ACTIVE)
    # Measured pulls go to the solver, its tensions come back as efforts.
    servos.lead_to("finger_3", 0.004)
    probe.until(lambda: abs(servos.joint("finger_3_main").tension - 4.18) < 0.3, "its tension")
    solved = probe.until(lambda: probe.states("finger_3") and probe.states("finger_3")[-1])
    assert solved.pulls[0] == pytest.approx(0.004, abs=2e-4)
    assert servos.joint("finger_1_main").tension == pytest.approx(0.0, abs=0.05)
    # And calibration finds the zero by them, so slowly that a solver that lags shifts it little.
    answer = servos.calibrate("finger_2_main")
    assert answer.success, answer.message
    assert answer.zeros[0] == pytest.approx(0.0, abs=0.1)


def test_tensions_that_are_not_in_newton_are_not_known(servos, probe, start_bridge):
    start_bridge()
    servos.in_state(ServoState.ACTIVE)
    solver = probe.node.create_publisher(FingerState, "finger_1/state", LATCHED)
    message = FingerState(finger="finger_1", cables=["main"], tensions=[7.0])
    for forces, known in ((FingerState.NEWTON, True), (FingerState.PER_EI, False)):
        message.forces_are = forces
        solver.publish(message)

        def as_it_should(known=known):
            tension = servos.joint("finger_1_main").tension
            return tension == pytest.approx(7.0) if known else math.isnan(tension)

        probe.until(as_it_should, f"tensions with forces {forces}")


def test_the_state_is_told_again_and_again_and_latched(servos, probe, start_bridge):
    start_bridge(**SPRING)
    servos.in_state(ServoState.ACTIVE)
    count = len(servos.states)
    probe.until(lambda: len(servos.states) >= count + 5, "heartbeats")
    late = probe.listen(ServoState, "/gripper/servo_state")
    probe.until(lambda: late)


def test_simulated_servos_keep_their_place_when_the_node_ends(
    servos, probe, start_bridge, tmp_path
):
    values = {**SPRING, "loopback__state_file": str(tmp_path / "rack.yaml")}
    node = start_bridge(**values)
    servos.in_state(ServoState.ACTIVE)
    servos.lead_to("finger_1", 0.006)
    probe.executor.remove_node(node)
    node.destroy_node()  # no farewell
    servos.states.clear()
    start_bridge(**values)
    servos.in_state(ServoState.ACTIVE)
    assert servos.joint("finger_1_main").pull == pytest.approx(0.006, abs=2e-4)
    assert servos.joint("finger_1_main").tension == pytest.approx(2.4, rel=0.1)
    assert servos.still("finger_1") < 2e-4
