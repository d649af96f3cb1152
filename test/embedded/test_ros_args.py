# SPDX-License-Identifier: Apache-2.0
"""The ``--ros-args`` command line."""

import pytest
import rclpy
from rclpy.exceptions import ParameterNotDeclaredException
from rclpy.logging import LoggingSeverity, get_logger_level, set_logger_level
from rclpy.utilities import remove_ros_args
from std_msgs.msg import String

FILE = """
/**:
  ros__parameters:
    everywhere: 1
    shared: from wildcard
/left/solver:
  ros__parameters:
    shared: from name
    rate: 1e-3
    finger:
      lengths: [0.1, 0.2]
      names: [a, b]
left:
  "*":
    ros__parameters: {in_namespace: true}
/right/solver:
  ros__parameters: {other: 1}
"""


@pytest.fixture
def with_args():
    """Make a node in a context with command line arguments."""
    contexts, nodes = [], []

    def make(*args, name="solver", **kwargs):
        context = rclpy.Context()
        contexts.append(context)
        rclpy.init(args=["program", *args], context=context)
        nodes.append(rclpy.create_node(name, context=context, **kwargs))
        return nodes[-1]

    yield make
    for node in nodes:
        node.destroy_node()
    for context in contexts:
        context.try_shutdown()


def test_node_name_and_namespace(with_args):
    node = with_args("--ros-args", "-r", "__node:=other", "-r", "__ns:=/left")
    assert node.get_fully_qualified_name() == "/left/other"
    assert node.get_logger().name == "left.other"


def test_rules_for_one_node_leave_others_alone(with_args):
    rule = ("--ros-args", "-r", "solver:__ns:=/left", "-r", "solver:chatter:=words")
    assert with_args(*rule).get_namespace() == "/left"
    assert with_args(*rule).resolve_topic_name("chatter") == "/left/words"
    assert with_args(*rule, name="viewer").get_namespace() == "/"
    assert with_args(*rule, name="viewer").resolve_topic_name("chatter") == "/chatter"


@pytest.mark.parametrize(
    ("rule", "topic", "expected"),
    [
        ("chatter:=words", "chatter", "/ns/words"),
        ("chatter:=/words", "chatter", "/words"),
        ("/ns/chatter:=words", "chatter", "/ns/words"),
        ("chatter:=words", "/chatter", "/chatter"),
        ("~/state:=state", "~/state", "/ns/state"),
        ("a/b:=c", "a/b", "/ns/c"),
        ("chatter:=~/words", "chatter", "/ns/solver/words"),
    ],
)
def test_topic_remaps(with_args, rule, topic, expected):
    node = with_args("--ros-args", "--remap", rule, namespace="/ns")
    assert node.resolve_topic_name(topic) == expected
    publisher = node.create_publisher(String, topic, 1)
    assert publisher.topic_name == expected


def test_names_expand_without_rules(with_args):
    node = with_args(namespace="/ns")
    assert node.resolve_topic_name("a") == "/ns/a"
    assert node.resolve_topic_name("/a") == "/a"
    assert node.resolve_topic_name("~/a") == "/ns/solver/a"
    assert node.resolve_topic_name("{node}/a") == "/ns/solver/a"


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1", 1),
        ("-5", -5),
        ("1.0", 1.0),
        ("1e-3", 1e-3),
        ("true", True),
        ("text", "text"),
        ("'1'", "1"),
        ("[1, 2]", [1, 2]),
        ("[1.5, 2.0]", [1.5, 2.0]),
        ("[a, b]", ["a", "b"]),
        # as C reads numbers, with the words of YAML 1.1 for truth, and no nulls
        ("010", 8),
        ("0x10", 16),
        ("09", 9.0),
        ("1_000", "1_000"),
        ("99999999999999999999", 1e20),
        ("-.inf", float("-inf")),
        ("inf", float("inf")),
        ("Y", True),
        ("off", False),
        ("null", "null"),
        ("2020-01-01", "2020-01-01"),
    ],
)
def test_parameter_values(with_args, text, value):
    node = with_args("--ros-args", "-p", f"p:={text}")
    default = type(value)() if not isinstance(value, list) else [type(value[0])()]
    got = node.declare_parameter("p", default).value
    assert got == value
    assert type(got) is type(value)


def test_parameters_for_one_node(with_args):
    args = ("--ros-args", "-p", "solver:p:=1")
    assert with_args(*args).declare_parameter("p", 0).value == 1
    assert with_args(*args, name="viewer").declare_parameter("p", 0).value == 0


def test_parameter_file_with_wildcards(with_args, tmp_path):
    path = tmp_path / "params.yaml"
    path.write_text(FILE)
    node = with_args(
        "--ros-args",
        "--params-file",
        str(path),
        namespace="/left",
        automatically_declare_parameters_from_overrides=True,
    )
    assert node.get_parameter("everywhere").value == 1
    assert node.get_parameter("shared").value == "from name"
    assert node.get_parameter("rate").value == 1e-3
    assert list(node.get_parameter("finger.lengths").value) == [0.1, 0.2]
    assert list(node.get_parameter("finger.names").value) == ["a", "b"]
    assert node.get_parameter("in_namespace").value is True
    with pytest.raises(ParameterNotDeclaredException):
        node.get_parameter("other")


def test_command_line_beats_an_earlier_file(with_args, tmp_path):
    path = tmp_path / "params.yaml"
    path.write_text("solver: {ros__parameters: {p: 1}}")
    node = with_args("--ros-args", "--params-file", str(path), "-p", "p:=2")
    assert node.declare_parameter("p", 0).value == 2


def test_node_arguments_beat_those_of_the_process(with_args):
    node = with_args("--ros-args", "-p", "p:=1", cli_args=["--ros-args", "-p", "p:=2"])
    assert node.declare_parameter("p", 0).value == 2
    deaf = with_args("--ros-args", "-p", "p:=1", use_global_arguments=False)
    assert deaf.declare_parameter("p", 0).value == 0


def test_log_level_of_one_logger(with_args):
    before = get_logger_level("some.logger")
    try:
        with_args("--ros-args", "--log-level", "some.logger:=error")
        assert get_logger_level("some.logger") == LoggingSeverity.ERROR
    finally:
        set_logger_level("some.logger", before)


def test_other_arguments_stay():
    args = ["program", "a", "--ros-args", "-r", "x:=y", "--", "b", "--ros-args", "-p", "p:=1"]
    assert remove_ros_args(args) == ["program", "a", "b"]


@pytest.mark.parametrize(
    "args",
    [
        ("-r", "no-rule"),
        ("-r", "__ns:=no spaces"),
        ("-p", "novalue"),
        ("-p", "p:=[1, a]"),
        ("-p", "p:="),
        ("-p", "two words:=1"),
        ("-r", "x:=/words/"),
        ("--params-file", "/does/not/exist.yaml"),
        ("--log-level", "loud"),
    ],
)
def test_bad_arguments_are_named(args):
    context = rclpy.Context()
    with pytest.raises(RuntimeError, match=args[1].split(":=")[0].replace("[", ".")):
        rclpy.init(args=["program", "--ros-args", *args], context=context)
    context.try_shutdown()


def test_names_in_parameter_files_are_text(with_args, tmp_path):
    file = tmp_path / "parameters.yaml"
    file.write_text("solver: {ros__parameters: {on: 1, y: 2, 7: 3}}")
    node = with_args("--ros-args", "--params-file", str(file))
    for name, value in (("on", 1), ("y", 2), ("7", 3)):
        assert node.declare_parameter(name, 0).value == value


def test_an_empty_parameter_file_says_nothing(with_args, tmp_path):
    file = tmp_path / "parameters.yaml"
    file.write_text("# nothing yet")
    node = with_args("--ros-args", "--params-file", str(file))
    assert node.declare_parameter("a", 1).value == 1


def test_rules_outside_of_ros_args_count_and_warn(with_args, capfd):
    node = with_args("chatter:=words", "--speed:=5", "__node:=other")
    assert node.get_fully_qualified_name() == "/other"
    assert node.resolve_topic_name("chatter") == "/words"
    assert "is deprecated" in capfd.readouterr().err
    assert remove_ros_args(["program", "a:=b", "--speed:=5"]) == ["program", "--speed:=5"]


def test_a_rule_without_its_flag_is_unknown():
    with pytest.raises(RuntimeError, match="a:=b"):
        rclpy.init(args=["program", "--ros-args", "a:=b"], context=rclpy.Context())
