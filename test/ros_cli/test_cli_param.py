# SPDX-License-Identifier: Apache-2.0
import pytest
import yaml
from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor

from ccr_ros.cli.ros import param

VALUES = {
    "flag": True,
    "count": 5,
    "speed": 1.5,
    "name": "bob",
    "arm.bits": [True, False],
    "arm.ids": [1, 2],
    "arm.gains": [1.0, 2.0],
    "arm.words": ["a", "b"],
}


@pytest.fixture
def robot(make_peer):
    """A node /ns/robot with a parameter of each type."""
    node = make_peer("robot", namespace="/ns")
    descriptors = {
        "count": ParameterDescriptor(
            description="how many", integer_range=[IntegerRange(from_value=0, to_value=10, step=1)]
        ),
        "speed": ParameterDescriptor(
            floating_point_range=[FloatingPointRange(from_value=0.0, to_value=9.5, step=0.5)],
            additional_constraints="slow is smooth",
        ),
        "name": ParameterDescriptor(read_only=True),
    }
    for name, value in VALUES.items():
        node.declare_parameter(name, value, descriptors.get(name, ParameterDescriptor()))
    return node


def test_list(ccr, robot):
    own = [f"  {name}" for name in sorted(VALUES)]
    assert set(own) <= set(ccr("param", "list", "/ns/robot").out.splitlines())
    everywhere = ccr("param", "list").out.splitlines()
    assert everywhere[0] == "/ns/robot:" and set(own) <= set(everywhere)
    arm = "  arm.bits\n  arm.gains\n  arm.ids\n  arm.words\n"
    assert ccr("param", "list", "ns/robot", "--param-prefixes", "arm").out == arm
    assert ccr("param", "list", "/ns/robot", "--filter", "arm").out == arm
    typed = ccr("param", "list", "/ns/robot", "--param-type").out.splitlines()
    assert {"  arm.words (type: string array)", "  count (type: integer)"} <= set(typed)


@pytest.mark.parametrize(
    ("name", "label"),
    [
        ("flag", "Boolean value is: True"),
        ("count", "Integer value is: 5"),
        ("speed", "Double value is: 1.5"),
        ("name", "String value is: bob"),
        ("arm.bits", "Boolean values are: [True, False]"),
        ("arm.ids", "Integer values are: [1, 2]"),
        ("arm.gains", "Double values are: [1.0, 2.0]"),
        ("arm.words", "String values are: ['a', 'b']"),
    ],
)
def test_get(ccr, robot, name, label):
    assert ccr("param", "get", "/ns/robot", name) == (0, f"{label}\n", "")
    bare = ccr("param", "get", "/ns/robot", name, "--hide-type").out
    assert bare == f"{VALUES[name]}\n"


@pytest.mark.parametrize(
    ("name", "text", "value"),
    [("count", "7", 7), ("speed", "2.5", 2.5), ("flag", "false", False), ("arm.ids", "[3]", [3])],
)
def test_set(ccr, robot, name, text, value):
    done = ccr("param", "set", "/ns/robot", name, text)
    assert done == (0, "Set parameter successful\n", "")
    found = robot.get_parameter(name).value
    assert list(found) == value if isinstance(value, list) else found == value


def test_what_the_node_refuses_gives_its_reason_and_exit_code_1(ccr, robot):
    for name, value in (("count", "70"), ("count", "many"), ("name", "eve"), ("nope", "1")):
        done = ccr("param", "set", "/ns/robot", name, value)
        assert done.code == 1 and done.out == ""
        assert done.err.startswith("Setting parameter failed: ") and done.err.count("\n") == 1
    assert robot.get_parameter("count").value == 5


def test_describe(ccr, robot):
    assert ccr("param", "describe", "/ns/robot", "count", "speed", "name").out == (
        "Parameter name: count\n  Type: integer\n  Description: how many\n  Constraints:\n"
        "    Min value: 0\n    Max value: 10\n    Step: 1\n"
        "Parameter name: speed\n  Type: double\n  Constraints:\n"
        "    Min value: 0.0\n    Max value: 9.5\n    Step: 0.5\n"
        "    Additional constraints: slow is smooth\n"
        "Parameter name: name\n  Type: string\n  Constraints:\n    Read only: true\n"
    )


def test_dump_and_load(ccr, robot, tmp_path):
    dumped = yaml.safe_load(ccr("param", "dump", "/ns/robot").out)
    found = dumped["/ns/robot"]["ros__parameters"]
    assert found["arm"]["gains"] == [1.0, 2.0] and found["count"] == 5
    file = tmp_path / "robot.yaml"
    changed = {"count": 3, "arm": {"gains": [7.0]}, "name": "eve"}
    file.write_text(yaml.safe_dump({"/ns/robot": {"ros__parameters": changed}}))
    done = ccr("param", "load", "/ns/robot", str(file))
    assert done.code == 1  # because of the name, which is read-only
    assert "Set parameter arm.gains successful\n" in done.out
    assert done.err.startswith("Set parameter name failed: ")
    assert list(robot.get_parameter("arm.gains").value) == [7.0]


def test_delete(ccr, make_peer):
    node = make_peer("free")
    node.declare_parameter("loose", 3, ParameterDescriptor(dynamic_typing=True))
    done = ccr("param", "delete", "/free", "loose")
    assert done == (0, "Deleted parameter successfully\n", "")
    assert not node.has_parameter("loose")


def test_errors(ccr, robot, tmp_path):
    def error(*words):
        done = ccr("param", *words)
        assert done.code == 2 and done.out == "" and done.err.count("\n") == 1
        return done.err.removeprefix("ccr: error: ")

    assert error("get", "/ns/robt", "count") == "no node '/ns/robt' (did you mean '/ns/robot'?)\n"
    near = "no parameter 'cout' of node '/ns/robot' (did you mean 'count'?)\n"
    assert error("get", "/ns/robot", "cout") == near
    assert error("describe", "/ns/robot", "cout") == near
    assert error("delete", "/ns/robot", "cout") == near
    assert error("set", "/ns/robot", "count", "[1").startswith("not YAML at line 1")
    assert error("set", "/ns/robot", "count", "{a: 1}") == (
        "value: '{a: 1}' is not allowed; must be a boolean, number or string, or a list of one "
        "of these\n"
    )
    assert error("list", "/ns/robot", "--filter", "(").startswith("--filter '(' is no regular ")
    assert error("load", "/ns/robot", "/no/file.yaml") == (
        "/no/file.yaml: No such file or directory\n"
    )
    file = tmp_path / "odd.yaml"
    file.write_text("/ns/robot: 3\n")
    assert error("load", "/ns/robot", str(file)).startswith(f"{file}: ")


def test_a_node_without_parameter_services(ccr, make_peer, monkeypatch):
    monkeypatch.setattr(param, "_ANSWER_LIMIT", 1.0)
    make_peer("mute", start_parameter_services=False)
    assert ccr("param", "list").out == ""
    done = ccr("param", "get", "/mute", "count")
    assert done.err == "ccr: error: node '/mute' has no parameter services\n"
