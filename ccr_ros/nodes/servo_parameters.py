# SPDX-License-Identifier: Apache-2.0
"""The servo bridge's parameters: declared with description and range, then read as one value."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rclpy.node import Node
from rclpy.parameter import Parameter

from ccr_ros.actuation.calibrator import CalibrationSettings
from ccr_ros.actuation.drivers.loopback import LoopbackSettings
from ccr_ros.actuation.rack import ServoRack, load_servos
from ccr_ros.actuation.states import BridgeSettings
from ccr_ros.model import Gripper, InvalidValue, UnknownName, load_gripper
from ccr_ros.resources import find_config

from .declarations import Declarations

DRIVERS = ("loopback", "ros2_control", "dynamixel")

_LOOPBACK = "loopback."
_BAUD_RATES = (9600, 57600, 115200, 1000000, 2000000, 3000000, 4000000)


@dataclass(frozen=True)
class ServoParameters:
    """What is fixed when the servo bridge starts.

    Attributes:
        gripper: From the gripper file.
        rack: From the servo file.
        driver: What moves the servos: one of `DRIVERS`.
        rate: Cycles per second [Hz].
        autostart: Whether the node configures and activates itself.
        settings: Of the bridge.
        calibration_file: Where zeros are kept.
        seed: Of the simulated servos' noise.
        state_file: Where simulated servos keep their angles; empty: nowhere.
        torque_per_effort: Of efforts in joint states; see `Ros2ControlDriver`.
        port, baud_rate, watchdog, current_unit: Of the Dynamixel bus; see `DynamixelDriver`.
    """

    gripper: Gripper
    rack: ServoRack
    driver: str
    rate: float
    autostart: bool
    settings: BridgeSettings
    calibration_file: Path
    seed: int
    state_file: str
    torque_per_effort: float
    port: str
    baud_rate: int
    watchdog: float
    current_unit: float


def declare(node: Node) -> ServoParameters:
    """Declare all parameters of the servo bridge and return the fixed ones.

    Raises:
        CcrError: A file is not found or not valid, or a setting is not.
        rclpy.exceptions.ParameterException: A value is of the wrong type or out of its range.
    """
    own = Declarations(node)
    gripper_file = own.fixed(
        "gripper_file",
        "gripper_sphere",
        "Gripper file: a path, or the name of a file that comes with ccr_ros.",
    )
    servo_file = own.fixed(
        "servo_file",
        "servos_sphere",
        "Servo file: a path, or the name of a file that comes with ccr_ros.",
    )
    driver = own.fixed(
        "driver",
        "loopback",
        "What moves the servos: simulated ones (loopback), ros2_control, a Dynamixel bus.",
        " or ".join((", ".join(DRIVERS[:-1]), DRIVERS[-1])),
    )
    rate = own.fixed("rate", 50.0, "Cycles per second [Hz].", (5.0, 500.0))
    autostart = own.fixed("autostart", True, "Configure and activate without being told to.")
    calibration_file = own.fixed(
        "calibration_file",
        "",
        "File of the zeros; empty: one per namespace, servo file and driver, in ~/.ros/ccr_ros.",
    )
    settings = _bridge(own)
    _loopback(own)
    seed = own.fixed("loopback.seed", 0, "Seed of the simulated noise.", (0, 1_000_000))
    state_file = own.fixed(
        "loopback.state_file",
        "",
        "File that simulated servos keep their angles in, as real ones keep theirs when the "
        "node dies; empty: none.",
    )
    torque_per_effort = own.fixed(
        "ros2_control.torque_per_effort",
        1.0,
        "Torque at a servo's shaft per unit of effort in its joint state [N m].",
        (1e-6, 1e6),
    )
    port = own.fixed("dynamixel.port", "/dev/ttyUSB0", "Serial port of the Dynamixel bus.")
    baud_rate = own.fixed(
        "dynamixel.baud_rate",
        1000000,
        "Baud rate of the Dynamixel bus.",
        ", ".join(map(str, _BAUD_RATES)),
    )
    watchdog = own.fixed(
        "dynamixel.watchdog",
        0.5,
        "Servos stop and hold when the bus is silent for this long [s]; 0: never.",
        (0.0, 2.54),
    )
    current_unit = own.fixed(
        "dynamixel.current_unit",
        0.00269,
        "Current of one count [A]: 0.00269 for most of the X series, 0.001 for XL330 and XC330.",
        (1e-5, 1.0),
    )
    if driver not in DRIVERS:
        raise UnknownName("driver", driver, DRIVERS)
    if baud_rate not in _BAUD_RATES:
        raise InvalidValue(
            "dynamixel.baud_rate", baud_rate, f"one of {', '.join(map(str, _BAUD_RATES))}"
        )
    gripper = load_gripper(find_config(gripper_file))
    rack = load_servos(find_config(servo_file), gripper)
    loopback_settings(node, rack)  # that a wrong joint name shows now
    return ServoParameters(
        gripper=gripper,
        rack=rack,
        driver=driver,
        rate=rate,
        autostart=autostart,
        settings=settings,
        calibration_file=(
            Path(calibration_file).expanduser()
            if calibration_file
            else _default_file(node.get_namespace(), rack, driver)
        ),
        seed=seed,
        state_file=state_file,
        torque_per_effort=torque_per_effort,
        port=port,
        baud_rate=baud_rate,
        watchdog=watchdog,
        current_unit=current_unit,
    )


def loopback_settings(
    node: Node, rack: ServoRack, changed: Sequence[Parameter] = ()
) -> LoopbackSettings:
    """Return how simulated servos behave by the parameters, some of which are about to change.

    Raises:
        UnknownName: A stalled joint is none.
    """
    values: dict[str, Any] = {
        name: parameter.value
        for name, parameter in node.get_parameters_by_prefix("loopback").items()
    }
    values |= {p.name.removeprefix(_LOOPBACK): p.value for p in changed if is_loopback(p)}
    for other in ("seed", "state_file"):
        values.pop(other, None)
    values["stalled"] = tuple(name.strip() for name in values["stalled"].split(",") if name.strip())
    for name in values["stalled"]:
        rack.index(name)
    return LoopbackSettings(**values)


def is_loopback(parameter: Parameter) -> bool:
    """Tell whether a parameter is of the simulated servos."""
    return parameter.name.startswith(_LOOPBACK)


def _bridge(own: Declarations) -> BridgeSettings:
    standard, search = BridgeSettings(), CalibrationSettings()
    return BridgeSettings(
        command_timeout=own.fixed(
            "command_timeout",
            standard.command_timeout,
            "A command older than this counts no more, and its cables hold [s].",
            (0.02, 60.0),
        ),
        bus_timeout=own.fixed(
            "bus_timeout",
            standard.bus_timeout,
            "Servos that have not answered for this long are a fault [s].",
            (0.02, 10.0),
        ),
        stall_time=own.fixed(
            "stall_time",
            standard.stall_time,
            "A servo off its setpoint that makes no progress for this long is a fault [s].",
            (0.05, 10.0),
        ),
        tension_filter=own.fixed(
            "tension_filter",
            standard.tension_filter,
            "Time constant of the low-pass filter on measured tensions [s]; 0: none.",
            (0.0, 5.0),
        ),
        calibration=CalibrationSettings(
            rate=own.fixed(
                "calibration.rate",
                search.rate,
                "Rate at which calibration winds cable [m/s].",
                (1e-4, 0.1),
            ),
            threshold=own.fixed(
                "calibration.threshold",
                search.threshold,
                "Rise of the tension that says that a cable is taut [N].",
                (0.01, 100.0),
            ),
            slack=own.fixed(
                "calibration.slack",
                search.slack,
                "Cable that calibration pays out after the tension has stopped falling [m].",
                (1e-4, 0.1),
            ),
            search=own.fixed(
                "calibration.search",
                search.search,
                "Most cable that calibration pays out, and most that it winds [m].",
                (1e-3, 1.0),
            ),
        ),
    )


def _loopback(own: Declarations) -> None:
    standard = LoopbackSettings()

    def live(name: str, text: str, limits: tuple[float, float] | str = "") -> None:
        own.live(f"{_LOOPBACK}{name}", getattr(standard, name), f"Simulated servos: {text}", limits)

    live("time_constant", "of the approach to the setpoint [s].", (1e-3, 10.0))
    live("max_speed", "largest speed [rad/s].", (1e-3, 1e3))
    live("backlash", "play between motor and spool [rad].", (0.0, 1.0))
    live("noise", "standard deviation of measured angles [rad].", (0.0, 1.0))
    live("effort_noise", "standard deviation of measured efforts [N m].", (0.0, 10.0))
    live("dropout", "the bus is dead.")
    own.live(
        f"{_LOOPBACK}stalled",
        "",
        "Simulated servos: names of the joints that do not move, with commas between.",
        "joint names",
    )
    live("temperature", "of all servos [degC].", (-50.0, 200.0))
    live(
        "spring",
        "stiffness of springs that stand in for fingers [N/m]; 0: the solver tells tensions.",
        (0.0, 1e6),
    )


def _default_file(namespace: str, rack: ServoRack, driver: str) -> Path:
    home = os.environ.get("ROS_HOME", "") or "~/.ros"
    words = [word for word in namespace.split("/") if word] + [rack.name, driver, "zeros.yaml"]
    return Path(home).expanduser() / "ccr_ros" / "_".join(words)
