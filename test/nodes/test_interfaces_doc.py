# SPDX-License-Identifier: Apache-2.0
"""docs/interfaces.md says what the running nodes do."""

from array import array
from pathlib import Path

import pytest
from rclpy.action import get_action_server_names_and_types_by_node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, HistoryPolicy, ReliabilityPolicy

PAGE = Path(__file__).resolve().parents[2] / "docs" / "interfaces.md"
# Those of every node, and of every managed one.
NOT_OURS = ("/rosout", "/parameter_events", "/gripper/servo_bridge_node/transition_event")
MANAGED = ("change_state", "get_state", "get_available_states", "get_available_transitions")
MANAGED = {f"/gripper/servo_bridge_node/{name}" for name in (*MANAGED, "get_transition_graph")}
CABLES = {"thumb": ("straight", "helical"), "index": ("main",)}
SPHERE = {f"finger_{i}": ("main",) for i in (1, 2, 3)}  # the coordinator's fingers here
TYPES = {
    Parameter.Type.STRING: "string",
    Parameter.Type.INTEGER: "integer",
    Parameter.Type.DOUBLE: "double",
    Parameter.Type.BOOL: "bool",
    Parameter.Type.DOUBLE_ARRAY: "double array",
}


def section(node):
    """Return the lines of a node's section."""
    lines = PAGE.read_text(encoding="utf-8").splitlines()
    start = lines.index(f"## {node}")
    ends = [i for i, line in enumerate(lines) if i > start and line.startswith("## ")]
    return lines[start : ends[0] if ends else None]


def table(node, first_column):
    """Return the rows of the table with this first heading, as dictionaries by heading."""
    lines = section(node)
    start = next(i for i, line in enumerate(lines) if line.startswith(f"| {first_column} |"))
    headings = cells(lines[start])
    rows = []
    for line in lines[start + 2 :]:
        if not line.startswith("|"):
            break
        rows.append(dict(zip(headings, cells(line), strict=True)))
    return rows


def cells(line):
    return [cell.strip().strip("`") for cell in line.strip("|").split("|")]


# The nodes that the page is about, and what is set for them here.
NODES = {
    "solver_node": ("start", "small_gripper", {"gripper_file"}),
    "servo_bridge_node": (
        "start_bridge",
        "small_rack",
        {"gripper_file", "servo_file", "calibration_file", "loopback.spring"},
    ),
    "gripper_coordinator_node": ("start_coordinator", "no_values", set()),
}


@pytest.fixture(params=list(NODES))
def node(request):
    start, files, _ = NODES[request.param]
    values = request.getfixturevalue(files)
    if isinstance(values, str):
        values = {"gripper_file": values}
    elif values:
        values = {**values, "loopback__spring": 400.0}
    return request.getfixturevalue(start)(**values)


@pytest.fixture
def no_values():
    return {}


def fingers_of(node):
    return SPHERE if node == "gripper_coordinator_node" else CABLES


def qos_text(qos):
    assert qos.history == HistoryPolicy.KEEP_LAST
    latched = qos.durability == DurabilityPolicy.TRANSIENT_LOCAL
    reliable = "reliable" if qos.reliability == ReliabilityPolicy.RELIABLE else "best effort"
    return f"{reliable}, keep last {qos.depth}, {'latched' if latched else 'volatile'}"


def type_text(kind):
    package, module, *_ = kind.__module__.split(".")
    return f"{package}/{module}/{kind.__name__}"


def documented(node, direction, first_column="topic"):
    for row in table(node, first_column):
        if row["direction"] != direction:
            continue
        topic = row[first_column]
        name = topic if topic.startswith("/") else f"/gripper/{topic}"
        for finger, cables in fingers_of(node).items():
            for cable in cables:
                full = name.replace("<finger>", finger).replace("<cable>", cable)
                yield full, (row["type"], row["QoS"])


@pytest.mark.parametrize("direction", ["in", "out"])
def test_topics(node, direction):
    endpoints = node.subscriptions if direction == "in" else node.publishers
    found = {
        e.topic_name: (type_text(e.msg_type), qos_text(e.qos_profile))
        for e in endpoints
        if e.topic_name not in NOT_OURS
    }
    assert found == dict(documented(node.get_name(), direction))


def test_topics_of_mode_gripper(start, small_gripper):
    def publishers(node):
        found = {e.topic_name: (type_text(e.msg_type), qos_text(e.qos_profile))
                 for e in node.publishers}  # fmt: skip
        return {name: found[name] for name in found if name not in NOT_OURS}

    node = start(gripper_file=small_gripper, mode="gripper")
    of_both = dict(documented("solver_node", "out"))
    more = dict(documented("solver_node", "out", "topic in mode gripper"))
    assert publishers(node) == {**of_both, **more} and len(more) == 2


def services(node):
    return {s.service_name: type_text(s.srv_type) for s in node.services}


def test_services(node, probe):
    name = node.get_name()
    documented = {
        f"/gripper/{row['service']}".replace("~", name): row["type"]
        for row in table(name, "service")
    }
    of_every_node = {
        service.replace("/probe/", f"/{name}/"): kind
        for service, kind in services(probe.node).items()
    }
    found = services(node).items() - of_every_node.items()
    assert documented.items() == {(s, kind) for s, kind in found if s not in MANAGED}


def parameter_names(node):
    return {p.name for p in node.get_parameters_by_prefix("").values()}


def default_text(value):
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, array):
        return str([round(number, 9) for number in value])
    return str(value) or "empty"


def test_parameters(node, probe):
    rows = {
        row["parameter"].replace("<finger>", finger): row
        for row in table(node.get_name(), "parameter")
        for finger in fingers_of(node.get_name())
    }
    set_here = NODES[node.get_name()][2]
    assert parameter_names(node) - parameter_names(probe.node) == set(rows)
    for name, row in rows.items():
        parameter, descriptor = node.get_parameter(name), node.describe_parameter(name)
        assert row["type"] == TYPES[parameter.type_], name
        assert row["read-only"] == ("yes" if descriptor.read_only else "no"), name
        if name not in set_here:
            assert row["default"] == default_text(parameter.value), name
        ranges = [*descriptor.integer_range, *descriptor.floating_point_range]
        limits = f"{ranges[0].from_value:g} to {ranges[0].to_value:g}" if ranges else ""
        assert row["range"] == (limits or descriptor.additional_constraints or "-"), name


def test_joint_states_are_read_where_ros2_control_tells_them(start_bridge, small_rack):
    node = start_bridge(**small_rack, driver="ros2_control", autostart=False)
    topic = "/gripper/joint_states"
    (heard,) = (s for s in node.subscriptions if s.topic_name == topic)
    assert qos_text(heard.qos_profile) in " ".join(section("servo_bridge_node"))
    assert topic not in {p.topic_name for p in node.publishers}
    assert "/gripper/thumb/state" not in {s.topic_name for s in node.subscriptions}


def test_actions(start_coordinator, probe):
    node = start_coordinator()
    documented = {
        f"/gripper/{row['action']}": [row["type"]] for row in table(node.get_name(), "action")
    }
    found = probe.until(
        lambda: dict(
            get_action_server_names_and_types_by_node(probe.node, node.get_name(), "/gripper")
        ),
        "the actions on the graph",
    )
    optional = documented.pop("/gripper/gripper_cmd")
    assert found in (documented, {**documented, "/gripper/gripper_cmd": optional})
