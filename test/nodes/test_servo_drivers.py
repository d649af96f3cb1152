# SPDX-License-Identifier: Apache-2.0
"""The servo bridge on real kinds of racks: a controller of ros2_control, a Dynamixel bus."""

import math
import sys
from pathlib import Path

import pytest
from ccr_msgs.msg import ServoState
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

from ccr_ros.model import CcrError
from ccr_ros.nodes.qos import JOINT_STATES

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "actuation"))
from dynamixel_servos import GOAL, HARDWARE_ERROR, POSITION, TORQUE, DynamixelServos

NAMES = [f"finger_{i}_main" for i in (1, 2, 3)]


class Controller(Node):
    """What forward_command_controller and joint_state_broadcaster are to the bridge.

    Its joints are springs of 400 N/m from the angle 1.0 on, on spools of 10 mm.
    """

    def __init__(self, **options):
        super().__init__("controller", **options)
        self.angles = [1.0, 1.0, 1.0]
        self.commands = []
        self.states = self.create_publisher(JointState, "joint_states", JOINT_STATES)
        self.create_subscription(Float64MultiArray, "servo_commands", self.take, 10)
        self.timer = self.create_timer(0.02, self.tell)

    def take(self, message):
        self.commands.append(list(message.data))
        self.angles = list(message.data)

    def tell(self):
        stamp = self.get_clock().now().to_msg()
        message = JointState(name=["elbow", *reversed(NAMES)])
        message.header.stamp = stamp
        message.position = [9.0, *reversed(self.angles)]
        message.effort = [0.0, *(4.0 * max(0.0, a - 1.0) * 0.01 for a in reversed(self.angles))]
        self.states.publish(message)


@pytest.fixture
def controller(context, probe):
    return probe.add(Controller(context=context, namespace="gripper"))


def zeros(tmp_path, driver, zero):
    (tmp_path / "zeros.yaml").write_text(
        f"servos: servos_sphere\ndriver: {driver}\nzeros: {dict.fromkeys(NAMES, zero)}\n"
    )


def test_ros2_control(servos, probe, start_bridge, controller, tmp_path):
    zeros(tmp_path, "ros2_control", 1.0)
    controller.angles = [1.2, 1.0, 1.0]  # 2 mm are wound already
    start_bridge(driver="ros2_control")
    servos.in_state(ServoState.ACTIVE)  # by itself, as soon as joint states come
    assert servos.still("finger_1") == 0.0
    assert servos.joint("finger_1_main").tension == pytest.approx(0.8, rel=0.01)
    servos.lead_to("finger_1", 0.005)
    assert controller.angles[0] == pytest.approx(1.5, abs=0.02)
    assert controller.angles[1:] == pytest.approx([1.0, 1.0], abs=1e-6)
    assert servos.joint("finger_1_main").tension == pytest.approx(2.0, rel=0.05)
    assert math.isnan(servos.joint("finger_1_main").temperature)

    controller.timer.cancel()  # the controller falls silent
    state = servos.in_state(ServoState.FAULT)
    assert state.fault == ServoState.BUS_LOST and "no joint states of" in state.reason
    assert "no joint states" in servos.trigger("reset").message
    controller.commands.clear()
    controller.timer.reset()
    probe.spin_for(0.3)
    assert servos.state.state == ServoState.FAULT and not controller.commands
    assert servos.trigger("reset").success
    assert servos.still("finger_1") < 1e-4
    servos.lead_to("finger_1", 0.001)


def test_ros2_control_is_calibrated(servos, start_bridge, controller):
    controller.angles = [1.1, 0.8, 1.0]
    start_bridge(driver="ros2_control", calibration__rate=0.02, bus_timeout=5.0)
    servos.in_state(ServoState.ACTIVE)
    assert not servos.joint("finger_1_main").calibrated
    assert math.isnan(servos.joint("finger_1_main").pull)
    answer = servos.calibrate()
    assert answer.success, answer.message
    assert list(answer.zeros) == pytest.approx([1.0, 1.0, 1.0], abs=0.05)
    servos.in_state(ServoState.ACTIVE)
    servos.lead_to("finger_2", 0.003)


def test_wrong_joint_states_are_refused(servos, probe, start_bridge, controller, tmp_path):
    zeros(tmp_path, "ros2_control", 1.0)
    start_bridge(driver="ros2_control", bus_timeout=5.0)
    servos.in_state(ServoState.ACTIVE)
    for message in (
        JointState(name=NAMES, position=[math.nan, 1.0, 1.0]),
        JointState(name=NAMES, position=[1.0]),
        JointState(name=[NAMES[0]] * 2, position=[2.0, 3.0]),
    ):
        probe.publish("joint_states", message)
    probe.spin_for(0.2)
    assert servos.state.state == ServoState.ACTIVE
    assert servos.joint("finger_1_main").pull == 0.0


@pytest.fixture
def rack(monkeypatch):
    pytest.importorskip("dynamixel_sdk")
    # Simulated servos may be late on a busy machine.
    monkeypatch.setattr("dynamixel_sdk.port_handler.LATENCY_TIMER", 500)
    rack = DynamixelServos(1, 2, 3)
    yield rack
    rack.close()


def test_dynamixel(servos, probe, start_bridge, rack, tmp_path):
    zero = 2048 * 2 * math.pi / 4096
    zeros(tmp_path, "dynamixel", zero)
    rack[2].put(POSITION, 2348)
    node = start_bridge(
        driver="dynamixel", dynamixel__port=rack.port, dynamixel__watchdog=0.0, rate=20.0
    )
    servos.in_state(ServoState.ACTIVE)
    assert servos.joint("finger_2_main").pull == pytest.approx(300 * 2 * math.pi / 4096 * 0.01)
    assert servos.still("finger_2") == 0.0
    assert servos.joint("finger_2_main").temperature == 30.0
    servos.lead_to("finger_1", 0.004)
    assert rack[1].get(POSITION) == pytest.approx(2048 + 0.4 / (2 * math.pi / 4096), abs=8)

    rack[3].put(HARDWARE_ERROR, 0b100000)
    state = servos.in_state(ServoState.FAULT)
    assert (state.fault, state.joint) == (ServoState.SERVO_ERROR, "finger_3_main")
    assert "overload" in state.reason
    answer = servos.trigger("reset")
    assert not answer.success and "still holds with overload" in answer.message
    rack[3].put(TORQUE, 0)
    assert servos.trigger("reset").success
    assert rack[3].reboots == 1
    servos.in_state(ServoState.ACTIVE)

    goals = [rack[i].get(GOAL) for i in (1, 2, 3)]
    node.end()  # as at the end of the process
    assert [rack[i].get(GOAL) for i in (1, 2, 3)] == goals
    assert [rack[i].get(TORQUE) for i in (1, 2, 3)] == [1, 1, 1]
    assert [rack[i].lowered for i in (1, 2)] == [0, 0]


def test_a_dynamixel_bus_that_is_not_there(start_bridge):
    pytest.importorskip("dynamixel_sdk")
    with pytest.raises(CcrError, match="/dev/no_such_port cannot be opened"):
        start_bridge(driver="dynamixel", dynamixel__port="/dev/no_such_port")


def test_a_bridge_whose_bus_came_later(servos, context, start_bridge, rack):
    """Not started by itself, it waits to be configured."""
    node = start_bridge(driver="dynamixel", dynamixel__port=rack.port, autostart=False)
    rack[1].mute = True
    node.trigger_configure()
    assert "servo 1" in servos.probe.until(lambda: servos.state.reason)
    rack[1].mute = False
    node.trigger_configure()
    servos.in_state(ServoState.INACTIVE)
    assert [rack[i].get(TORQUE) for i in (1, 2, 3)] == [0, 0, 0]  # untouched until activation
    (result,) = node.set_parameters([Parameter("loopback.dropout", value=True)])
    assert result.successful  # means nothing here, does no harm
    node.trigger_activate()
    servos.in_state(ServoState.ACTIVE)
    assert [rack[i].get(TORQUE) for i in (1, 2, 3)] == [1, 1, 1]
