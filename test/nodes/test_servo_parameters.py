# SPDX-License-Identifier: Apache-2.0
"""Parameters of the servo bridge: described, checked, and some set while it runs."""

import pytest
from ccr_msgs.msg import ServoState
from rclpy.exceptions import ParameterException
from rclpy.parameter import Parameter

from ccr_ros.model import CcrError

OFF = {"autostart": False}


def test_every_parameter_is_described(start_bridge):
    node = start_bridge(**OFF)
    names = [p.name for p in node.get_parameters_by_prefix("").values()]
    own = [n for n in names if n not in ("use_sim_time", "start_type_description_service")]
    assert len(own) >= 30
    for descriptor in node.describe_parameters(own):
        if descriptor.name.startswith("qos_overrides"):
            continue
        assert len(descriptor.description) > 15, descriptor.name
        live = descriptor.name.startswith("loopback.") and descriptor.name not in (
            "loopback.seed",
            "loopback.state_file",
        )
        assert descriptor.read_only != live, descriptor.name


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("rate", 0.0),
        ("rate", 1000.0),
        ("rate", "fast"),
        ("command_timeout", 0.0),
        ("bus_timeout", -1.0),
        ("calibration__rate", 1.0),
        ("loopback__time_constant", 0.0),
        ("loopback__dropout", 1),
        ("dynamixel__watchdog", 3.0),
        ("autostart", "yes"),
    ],
)
def test_out_of_range_at_start(start_bridge, name, value):
    with pytest.raises(ParameterException, match=name.replace("__", r"\.")):
        start_bridge(**OFF | {name: value})


@pytest.mark.parametrize(
    ("name", "value", "text"),
    [
        ("driver", "magic", "unknown driver 'magic'; valid: loopback, ros2_control, dynamixel"),
        ("gripper_file", "helical", r"helical\.yaml"),
        ("servo_file", "no_such", "servos_sphere"),
        ("servo_file", "gripper_sphere", "fingers: unknown key"),
        ("gripper_file", "/no/such.yaml", "no such file"),
        ("loopback__stalled", "finger_1_main,finger_8_main", "'finger_8_main'"),
        ("dynamixel__baud_rate", 12345, r"dynamixel\.baud_rate: 12345"),
    ],
)
def test_not_valid_at_start(start_bridge, name, value, text):
    with pytest.raises(CcrError, match=text):
        start_bridge(**OFF | {name: value})


def test_a_rack_has_to_fit_its_gripper(start_bridge, small_gripper):
    with pytest.raises(CcrError, match=r"joints\[0\]\.finger: 'finger_1'"):
        start_bridge(gripper_file=small_gripper)


def test_refused_while_running(start_bridge):
    node = start_bridge(loopback__spring=400.0)
    for name, value in (
        ("rate", 20.0),
        ("driver", "dynamixel"),
        ("loopback.backlash", -0.1),
        ("loopback.stalled", "finger_8_main"),
        ("loopback.seed", 3),
    ):
        before = node.get_parameter(name).value
        (result,) = node.set_parameters([Parameter(name, value=value)])
        assert not result.successful and result.reason, name
        assert node.get_parameter(name).value == before


def test_simulated_servos_are_changed_while_they_run(servos, start_bridge):
    node = start_bridge(loopback__spring=400.0)
    servos.in_state(ServoState.ACTIVE)
    node.set_parameters([Parameter("loopback.temperature", value=42.0)])
    servos.probe.until(lambda: servos.joint("finger_1_main").temperature == 42.0)


def test_the_rate_is_kept(servos, probe, start_bridge):
    start_bridge(loopback__spring=400.0, rate=20.0)
    servos.in_state(ServoState.ACTIVE)
    heard = servos.pulls("finger_1")
    probe.until(lambda: len(heard) >= 12)
    times = [m.header.stamp.sec + 1e-9 * m.header.stamp.nanosec for m in heard]
    # No more often; on a busy machine, less.
    assert (times[-1] - times[0]) / (len(times) - 1) > 0.95 / 20.0
