# SPDX-License-Identifier: Apache-2.0
"""Parameters of a node."""

import pytest
from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    ParameterEvent,
    SetParametersResult,
)
from rclpy.exceptions import (
    InvalidParameterTypeException,
    InvalidParameterValueException,
    ParameterAlreadyDeclaredException,
    ParameterImmutableException,
    ParameterNotDeclaredException,
    ParameterUninitializedException,
)
from rclpy.parameter import Parameter


def integers(low, high, step=0):
    return ParameterDescriptor(
        integer_range=[IntegerRange(from_value=low, to_value=high, step=step)]
    )


def floats(low, high, step=0.0):
    return ParameterDescriptor(
        floating_point_range=[FloatingPointRange(from_value=low, to_value=high, step=step)]
    )


@pytest.mark.parametrize(
    ("value", "kind"),
    [
        (True, Parameter.Type.BOOL),
        (1, Parameter.Type.INTEGER),
        (1.0, Parameter.Type.DOUBLE),
        ("a", Parameter.Type.STRING),
        ([b"a"], Parameter.Type.BYTE_ARRAY),
        ([True, False], Parameter.Type.BOOL_ARRAY),
        ([1, 2], Parameter.Type.INTEGER_ARRAY),
        ([1.0], Parameter.Type.DOUBLE_ARRAY),
        (["a", "b"], Parameter.Type.STRING_ARRAY),
    ],
)
def test_types_follow_from_values_and_survive_messages(node, value, kind):
    parameter = node.declare_parameter("p", value)
    assert (parameter.type_, parameter.value) == (kind, value)
    copy = Parameter.from_parameter_msg(parameter.to_parameter_msg())
    assert copy.type_ == kind
    assert list(copy.value) == value if isinstance(value, list) else copy.value == value


@pytest.mark.parametrize("value", [object(), {"a": 1}, [1, "a"]])
def test_other_values_are_refused(node, value):
    with pytest.raises(TypeError):
        node.declare_parameter("p", value)


def test_declaring_twice_and_using_the_undeclared(node):
    node.declare_parameter("p", 1)
    with pytest.raises(ParameterAlreadyDeclaredException):
        node.declare_parameter("p", 2)
    with pytest.raises(ParameterNotDeclaredException):
        node.get_parameter("q")
    with pytest.raises(ParameterNotDeclaredException):
        node.set_parameters([Parameter("q", value=1)])
    assert node.get_parameter_or("q", Parameter("q", value=5)).value == 5


def test_overrides_beat_defaults(make_node):
    node = make_node(parameter_overrides=[Parameter("p", value=7)])
    assert node.declare_parameter("p", 1).value == 7
    with pytest.raises(InvalidParameterTypeException):
        make_node("other", parameter_overrides=[Parameter("p", value="7")]).declare_parameter(
            "p", 1
        )


def test_static_typing(node):
    node.declare_parameter("p", 1)
    result = node.set_parameters([Parameter("p", value=1.5)])[0]
    assert not result.successful
    assert "Wrong parameter type" in result.reason
    assert node.get_parameter("p").value == 1
    assert node.set_parameters([Parameter("p", value=2)])[0].successful


def test_dynamic_typing(node):
    node.declare_parameter("p", 1, ParameterDescriptor(dynamic_typing=True))
    assert node.set_parameters([Parameter("p", value="text")])[0].successful
    assert node.get_parameter("p").value == "text"


def test_typed_but_unset(node):
    node.declare_parameter("p", Parameter.Type.DOUBLE)
    with pytest.raises(ParameterUninitializedException):
        node.get_parameter("p")
    assert node.set_parameters([Parameter("p", value=2.0)])[0].successful
    assert node.get_parameter("p").value == 2.0


def test_read_only(node):
    node.declare_parameter("p", 1, ParameterDescriptor(read_only=True))
    result = node.set_parameters([Parameter("p", value=2)])[0]
    assert not result.successful
    assert "read-only" in result.reason
    with pytest.raises(ParameterImmutableException):
        node.undeclare_parameter("p")


@pytest.mark.parametrize(
    ("descriptor", "start", "good", "bad"),
    [
        (integers(-5, 10), 0, [-5, 10, 3], [-6, 11]),
        (integers(0, 10, 3), 0, [3, 9, 10], [1, 8]),
        (floats(0.0, 1.0), 0.5, [0.0, 1.0, 0.25], [-0.01, 1.01]),
        (floats(0.0, 1.0, 0.25), 0.5, [0.75, 1.0], [0.3]),
    ],
)
def test_ranges(node, descriptor, start, good, bad):
    node.declare_parameter("p", start, descriptor)
    for value in good:
        assert node.set_parameters([Parameter("p", value=value)])[0].successful
    kept = node.get_parameter("p").value
    for value in bad:
        assert not node.set_parameters([Parameter("p", value=value)])[0].successful
        assert node.get_parameter("p").value == kept


def test_default_outside_of_its_range_is_refused(node):
    with pytest.raises(InvalidParameterValueException):
        node.declare_parameter("p", 20, integers(0, 10))


def test_callbacks_refuse_and_hear(node):
    node.declare_parameters("", [("a", 1), ("b", 1)])
    heard = []

    def refuse_negative(parameters):
        good = all(p.value >= 0 for p in parameters)
        return SetParametersResult(successful=good, reason="" if good else "negative")

    node.add_on_set_parameters_callback(refuse_negative)
    node.add_post_set_parameters_callback(lambda ps: heard.extend((p.name, p.value) for p in ps))
    both = [Parameter("a", value=2), Parameter("b", value=-2)]
    result = node.set_parameters_atomically(both)
    assert (result.successful, result.reason) == (False, "negative")
    assert node.get_parameter("a").value == 1
    assert heard == []
    assert [r.successful for r in node.set_parameters(both)] == [True, False]
    assert (node.get_parameter("a").value, node.get_parameter("b").value) == (2, 1)
    assert heard == [("a", 2)]
    node.remove_on_set_parameters_callback(refuse_negative)
    assert node.set_parameters([both[1]])[0].successful


def test_pre_set_callback_changes_the_list(node):
    node.declare_parameters("", [("a", 1), ("b", 1)])
    node.add_pre_set_parameters_callback(lambda ps: [*ps, Parameter("b", value=ps[0].value * 2)])
    assert node.set_parameters([Parameter("a", value=4)])[0].successful
    assert node.get_parameter("b").value == 8


def test_names_by_prefix_and_listing(node):
    node.declare_parameters("finger", [("length", 0.2), ("disk.radius", 0.01)])
    assert set(node.get_parameters_by_prefix("finger")) == {"length", "disk.radius"}
    listed = node.list_parameters(["finger"], 1)
    assert list(listed.names) == ["finger.length"]
    assert list(node.list_parameters(["finger"], 0).prefixes) == ["finger", "finger.disk"]


def test_undeclared_parameters_where_allowed(make_node):
    node = make_node(allow_undeclared_parameters=True)
    assert node.get_parameter("p").type_ == Parameter.Type.NOT_SET
    assert node.set_parameters([Parameter("p", value=1)])[0].successful
    assert node.get_parameter("p").value == 1
    node.set_parameters([Parameter("p")])
    assert not node.has_parameter("p")


def test_changes_are_announced(node, make_node, spin):
    events = []
    listener = make_node("listener")
    listener.create_subscription(
        ParameterEvent, "/parameter_events", lambda e: events.append(e), 100
    )
    assert spin(lambda: listener.count_publishers("/parameter_events") == 2, listener)
    # Discovery may be one-sided for a moment: announce until it is heard.
    node.declare_parameter("p", 0)
    count = [0]

    def heard():
        count[0] += 1
        node.set_parameters([Parameter("p", value=count[0])])
        return any(e.node == "/tester" and e.changed_parameters for e in events)

    assert spin(heard, listener)
    changed = next(e for e in events if e.changed_parameters).changed_parameters[0]
    assert changed.name == "p"
    assert changed.value.integer_value > 0


def test_describe(node):
    node.declare_parameter("p", 1, ParameterDescriptor(description="a number"))
    descriptor = node.describe_parameter("p")
    assert (descriptor.name, descriptor.description) == ("p", "a number")
    assert descriptor.type == Parameter.Type.INTEGER.value


def test_a_new_descriptor_must_name_the_type(node):
    node.declare_parameter("speed", 1)
    with pytest.raises(InvalidParameterValueException):
        node.set_descriptor("speed", ParameterDescriptor(description="m/s"))
    wanted = ParameterDescriptor(description="m/s", type=Parameter.Type.INTEGER.value)
    assert node.set_descriptor("speed", wanted).integer_value == 1
    assert node.describe_parameter("speed").description == "m/s"
