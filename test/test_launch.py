# SPDX-License-Identifier: Apache-2.0
"""The launch file, with stand-ins for launch and launch_ros where they are not installed."""

import importlib.util
import sys
import types
from importlib.metadata import distribution
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[1]
FILE = ROOT / "launch" / "gripper.launch.py"


class Recorded:
    """Stands in for a class of launch: keeps what it was made with."""

    def __init__(self, *args, **kwargs):
        self.args, self.kwargs = args, kwargs

    def perform(self, context):
        return context[self.args[0]]


@pytest.fixture
def launch_file(monkeypatch):
    """The launch file's module, with every class of launch recorded."""
    for name, classes in {
        "launch": ["LaunchDescription"],
        "launch.actions": ["DeclareLaunchArgument", "OpaqueFunction"],
        "launch.substitutions": ["LaunchConfiguration"],
        "launch_ros": [],
        "launch_ros.actions": ["Node"],
        "launch_ros.substitutions": ["FindPackageShare"],
    }.items():
        module = types.ModuleType(name)
        for kind in classes:
            setattr(module, kind, type(kind, (Recorded,), {}))
        monkeypatch.setitem(sys.modules, name, module)
    spec = importlib.util.spec_from_file_location("gripper_launch", FILE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def nodes(module, **given):
    """Return the nodes for arguments, by executable."""
    entities = module.generate_launch_description().args[0]
    *arguments, function = entities
    values = {a.args[0]: a.kwargs["default_value"] for a in arguments}
    assert set(given) <= set(values)
    context = {**values, **given, "ccr_ros": "/share/ccr_ros"}
    made = function.kwargs["function"](context)
    return {node.kwargs["executable"]: node.kwargs for node in made}


def test_by_default_the_three_nodes_of_the_sphere_gripper(launch_file):
    made = nodes(launch_file)
    assert list(made) == ["solver_node", "servo_bridge_node", "gripper_coordinator_node"]
    scripts = {e.name for e in distribution("ccr_ros").entry_points.select(group="console_scripts")}
    for name, kwargs in made.items():
        assert name in scripts
        assert (kwargs["package"], kwargs["namespace"]) == ("ccr_ros", "gripper")
        assert kwargs["parameters"][-1]["gripper_file"] == "gripper_sphere"
        assert "mode" not in kwargs["parameters"][-1]  # a parameter file may say
    assert made["servo_bridge_node"]["parameters"][-1]["driver"] == "loopback"


def test_arguments_reach_the_nodes(launch_file):
    made = nodes(
        launch_file,
        gripper_file="my.yaml",
        servo_file="servos.yaml",
        driver="dynamixel",
        mode="gripper",
        namespace="/left/",
        params_file="params.yaml",
        coordinator="false",
        rviz="true",
    )
    assert list(made) == ["solver_node", "servo_bridge_node", "rviz2"]
    files, own = made["servo_bridge_node"]["parameters"]
    assert files == "params.yaml"
    assert own == {"gripper_file": "my.yaml", "driver": "dynamixel", "servo_file": "servos.yaml"}
    assert made["solver_node"]["namespace"] == "left"
    assert made["solver_node"]["parameters"][-1] == {"gripper_file": "my.yaml", "mode": "gripper"}
    assert made["rviz2"]["arguments"] == [
        "-d", "/share/ccr_ros/rviz/gripper.rviz", "-f", "left/gripper_base",
    ]  # fmt: skip


def test_choices_are_those_of_the_nodes(launch_file):
    from ccr_ros.nodes.parameters import MODES
    from ccr_ros.nodes.servo_parameters import DRIVERS

    arguments = launch_file.generate_launch_description().args[0][:-1]
    choices = {a.args[0]: a.kwargs["choices"] for a in arguments}
    assert tuple(choices["driver"]) == DRIVERS
    assert tuple(choices["mode"]) == ("", *MODES)
    assert all(a.kwargs["description"] for a in arguments)


def test_the_view_shows_what_the_solver_publishes():
    view = yaml.safe_load((ROOT / "rviz" / "gripper.rviz").read_text())["Visualization Manager"]
    displays = {d["Name"]: d for d in view["Displays"]}
    topic = displays["Markers"]["Topic"]
    assert topic["Value"] == "markers" and topic["Durability Policy"] == "Transient Local"
    assert view["Global Options"]["Fixed Frame"] == "gripper/gripper_base"


@pytest.mark.skipif(
    importlib.util.find_spec("launch_ros") is None, reason="launch_ros is not installed"
)
def test_the_real_launch_takes_it():
    from launch import LaunchContext, LaunchDescription

    spec = importlib.util.spec_from_file_location("gripper_launch", FILE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    description = module.generate_launch_description()
    assert isinstance(description, LaunchDescription)
    context = LaunchContext()
    *arguments, function = description.entities
    for argument in arguments:
        argument.execute(context)
    assert len(function.execute(context)) == 3
