# SPDX-License-Identifier: Apache-2.0
"""The servo bridge as a managed node: what it does in which state, and that it always holds."""

import pytest
from ccr_msgs.msg import ServoState
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.lifecycle import TransitionCallbackReturn
from sensor_msgs.msg import JointState

from ccr_ros.model import CcrError
from ccr_ros.nodes.servo_bridge_node import ServoBridgeNode

MANUAL = {"loopback__spring": 400.0, "autostart": False}


def change(servos, transition):
    """Ask for a transition, as `ros2 lifecycle set` does."""
    request = ChangeState.Request(transition=Transition(id=transition))
    return servos.call(ChangeState, "servo_bridge_node/change_state", request).success


def state_id(servos):
    return servos.call(GetState, "servo_bridge_node/get_state").current_state.id


def test_from_unconfigured_to_active_and_back(servos, probe, start_bridge):
    start_bridge(**MANUAL)
    state = servos.in_state(ServoState.UNCONFIGURED)
    assert (state.driver, list(state.joints)) == ("loopback", [])
    assert not servos.trigger("reset").success
    assert "not configured" in servos.calibrate().message
    assert servos.trigger("stop").success

    assert change(servos, Transition.TRANSITION_CONFIGURE)
    servos.in_state(ServoState.INACTIVE)
    heard = servos.pulls("finger_1")
    probe.until(lambda: heard, "measured pulls of an inactive bridge")
    servos.command("finger_1", [0.005])
    assert servos.still("finger_1") == 0.0
    assert "INACTIVE" in servos.calibrate().message

    assert change(servos, Transition.TRANSITION_ACTIVATE)
    servos.in_state(ServoState.ACTIVE)
    assert servos.still("finger_1") == 0.0  # commands from before do not count
    servos.lead_to("finger_1", 0.006)

    assert change(servos, Transition.TRANSITION_DEACTIVATE)
    servos.in_state(ServoState.INACTIVE)
    servos.command("finger_1", [0.0])
    assert servos.still("finger_1") < 2e-4
    assert servos.joint("finger_1_main").tension == pytest.approx(2.4, rel=0.06)

    assert change(servos, Transition.TRANSITION_ACTIVATE)
    servos.in_state(ServoState.ACTIVE)
    assert servos.still("finger_1") < 1e-5
    servos.lead_to("finger_1", 0.002)

    assert change(servos, Transition.TRANSITION_DEACTIVATE)
    assert change(servos, Transition.TRANSITION_CLEANUP)
    servos.in_state(ServoState.UNCONFIGURED)
    assert state_id(servos) == State.PRIMARY_STATE_UNCONFIGURED
    heard.clear()
    probe.spin_for(0.2)
    assert not heard
    assert change(servos, Transition.TRANSITION_UNCONFIGURED_SHUTDOWN)
    assert state_id(servos) == State.PRIMARY_STATE_FINALIZED


def test_shutdown_while_active_holds(servos, probe, start_bridge, tmp_path):
    node = start_bridge(**MANUAL | {"autostart": True, "loopback__state_file": str(tmp_path / "s")})
    servos.in_state(ServoState.ACTIVE)
    servos.lead_to("finger_1", 0.006)
    driver = node._bridge.driver
    assert change(servos, Transition.TRANSITION_ACTIVE_SHUTDOWN)
    servos.in_state(ServoState.UNCONFIGURED)
    before = driver._setpoints[0]
    assert before == pytest.approx(0.6, rel=0.05)
    probe.spin_for(0.2)
    assert driver._setpoints[0] == before


def test_a_fault_outlives_deactivation(servos, start_bridge):
    node = start_bridge(**MANUAL | {"autostart": True})
    servos.in_state(ServoState.ACTIVE)
    node._bridge.driver.settings.temperature = 90.0
    servos.in_state(ServoState.FAULT)
    assert change(servos, Transition.TRANSITION_DEACTIVATE)
    assert not change(servos, Transition.TRANSITION_ACTIVATE)
    assert servos.state.state == ServoState.FAULT
    assert state_id(servos) == State.PRIMARY_STATE_INACTIVE
    node._bridge.driver.settings.temperature = 30.0
    servos.probe.spin_for(0.1)
    assert servos.trigger("reset").success
    servos.in_state(ServoState.INACTIVE)
    assert change(servos, Transition.TRANSITION_ACTIVATE)
    servos.in_state(ServoState.ACTIVE)


@pytest.mark.parametrize(
    ("content", "text"),
    [
        ("servos: other\ndriver: loopback\nzeros: {}\n", "servos: 'other'"),
        ("servos: servos_sphere\ndriver: loopback\nzeros: {finger_1_mian: 0.1}\n", "finger_1_mian"),
        ("zeros: [\n", "not valid YAML"),
    ],
)
def test_a_wrong_calibration_file_is_a_clear_error(servos, start_bridge, tmp_path, content, text):
    path = tmp_path / "zeros.yaml"
    path.write_text(content)
    node = start_bridge(**MANUAL)
    assert node.trigger_configure() == TransitionCallbackReturn.FAILURE
    state = servos.probe.until(lambda: servos.state.reason and servos.state)
    assert state.state == ServoState.UNCONFIGURED
    assert text in state.reason and str(path) in state.reason
    # The file put right, it is configured.
    path.unlink()
    assert node.trigger_configure() == TransitionCallbackReturn.SUCCESS
    servos.in_state(ServoState.INACTIVE)


def test_a_node_that_shall_start_by_itself_and_cannot_ends(start_bridge, tmp_path):
    (tmp_path / "zeros.yaml").write_text("zeros: [\n")
    with pytest.raises(CcrError, match="not valid YAML"):
        start_bridge()


def test_zeros_are_loaded(servos, start_bridge, tmp_path):
    (tmp_path / "zeros.yaml").write_text(
        "servos: servos_sphere\ndriver: loopback\nzeros: {finger_2_main: -0.2}\n"
    )
    start_bridge(loopback__spring=400.0)
    servos.in_state(ServoState.ACTIVE)
    assert servos.joint("finger_2_main").pull == pytest.approx(0.002)
    assert servos.joint("finger_1_main").pull == 0.0
    assert servos.still("finger_2") == 0.0


def test_two_grippers_side_by_side(servos, probe, start_bridge, tmp_path):
    start_bridge(loopback__spring=400.0)
    start_bridge(
        "left/gripper", loopback__spring=400.0, calibration_file=str(tmp_path / "left.yaml")
    )
    other = probe.listen(JointState, "/left/gripper/joint_states", latched=False)
    servos.in_state(ServoState.ACTIVE)
    servos.lead_to("finger_1", 0.005)
    probe.until(lambda: other)
    assert other[-1].position[0] == 0.0


def test_its_own_file_of_zeros_by_default(context, probe, monkeypatch, tmp_path):
    monkeypatch.setenv("ROS_HOME", str(tmp_path))
    node = probe.add(ServoBridgeNode(context=context, namespace="left/gripper"))
    expected = tmp_path / "ccr_ros" / "left_gripper_servos_sphere_loopback_zeros.yaml"
    assert node._fixed.calibration_file == expected
