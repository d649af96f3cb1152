# SPDX-License-Identifier: Apache-2.0
"""docs/interfaces.md says what the running node does."""

from pathlib import Path

import pytest
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, HistoryPolicy, ReliabilityPolicy

PAGE = Path(__file__).resolve().parents[2] / "docs" / "interfaces.md"
NOT_OURS = {"/rosout", "/parameter_events"}
CABLES = {"thumb": ("straight", "helical"), "index": ("main",)}
TYPES = {
    Parameter.Type.STRING: "string",
    Parameter.Type.INTEGER: "integer",
    Parameter.Type.DOUBLE: "double",
    Parameter.Type.BOOL: "bool",
}


def table(first_column):
    """Return the rows of the table with this first heading, as dictionaries by heading."""
    lines = PAGE.read_text(encoding="utf-8").splitlines()
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


@pytest.fixture
def node(start, small_gripper):
    return start(gripper_file=small_gripper)


def qos_text(qos):
    assert qos.reliability == ReliabilityPolicy.RELIABLE
    assert qos.history == HistoryPolicy.KEEP_LAST
    latched = qos.durability == DurabilityPolicy.TRANSIENT_LOCAL
    return f"reliable, keep last {qos.depth}, {'latched' if latched else 'volatile'}"


def type_text(kind):
    package, module, *_ = kind.__module__.split(".")
    return f"{package}/{module}/{kind.__name__}"


def documented(direction):
    for row in table("topic"):
        if row["direction"] != direction:
            continue
        name = row["topic"] if row["topic"].startswith("/") else f"/gripper/{row['topic']}"
        for finger, cables in CABLES.items():
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
    assert found == dict(documented(direction))


def services(node):
    return {s.service_name: type_text(s.srv_type) for s in node.services}


def test_services(node, probe):
    documented = {
        row["service"].replace("~", "/gripper/solver_node"): row["type"] for row in table("service")
    }
    of_every_node = {
        name.replace("/probe/", "/solver_node/"): kind
        for name, kind in services(probe.node).items()
    }
    assert documented.items() == services(node).items() - of_every_node.items()


def parameter_names(node):
    return {p.name for p in node.get_parameters_by_prefix("").values()}


def test_parameters(node, probe):
    rows = {row["parameter"]: row for row in table("parameter")}
    assert parameter_names(node) - parameter_names(probe.node) == set(rows)
    for name, row in rows.items():
        parameter, descriptor = node.get_parameter(name), node.describe_parameter(name)
        assert row["type"] == TYPES[parameter.type_], name
        assert row["read-only"] == ("yes" if descriptor.read_only else "no"), name
        if name != "gripper_file":  # the fixture sets it
            assert row["default"] == str(parameter.value).replace("True", "true"), name
        ranges = [*descriptor.integer_range, *descriptor.floating_point_range]
        limits = f"{ranges[0].from_value:g} to {ranges[0].to_value:g}" if ranges else ""
        assert row["range"] == (limits or descriptor.additional_constraints or "-"), name
