# SPDX-License-Identifier: Apache-2.0
"""QoS policies overridden by parameters."""

import pytest
from rclpy.duration import Duration
from rclpy.exceptions import ParameterException
from rclpy.parameter import Parameter
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    QoSPolicyKind,
    QoSProfile,
    ReliabilityPolicy,
)
from rclpy.qos_overriding_options import (
    InvalidQosOverridesError,
    QosCallbackResult,
    QoSOverridingOptions,
)
from std_msgs.msg import String

DEFAULTS = QoSOverridingOptions.with_default_policies()


@pytest.fixture
def overridden(make_node):
    """Make a node with overrides of what its topic ``text`` is made with."""

    def make(**values):
        start = "qos_overrides./ns/text."
        overrides = [Parameter(start + k.replace("__", "."), value=v) for k, v in values.items()]
        return make_node("talker", namespace="/ns", parameter_overrides=overrides)

    return make


def declared(node):
    found = node.get_parameters_by_prefix("qos_overrides")
    return {name: parameter.value for name, parameter in found.items()}


def test_policies_become_read_only_parameters(overridden):
    node = overridden()
    node.create_publisher(String, "text", 7, qos_overriding_options=DEFAULTS)
    assert declared(node) == {
        "/ns/text.publisher.history": "keep_last",
        "/ns/text.publisher.depth": 7,
        "/ns/text.publisher.reliability": "reliable",
    }
    name = "qos_overrides./ns/text.publisher.depth"
    assert node.describe_parameter(name).read_only
    assert not node.set_parameters([Parameter(name, value=8)])[0].successful


def test_overrides_count(overridden):
    node = overridden(publisher__depth=3, publisher__reliability="best_effort")
    publisher = node.create_publisher(String, "text", 7, qos_overriding_options=DEFAULTS)
    qos = publisher.qos_profile
    assert (qos.depth, qos.reliability) == (3, ReliabilityPolicy.BEST_EFFORT)
    assert qos.history == HistoryPolicy.KEEP_LAST
    second = node.create_publisher(String, "text", 7, qos_overriding_options=DEFAULTS)
    assert second.qos_profile.depth == 3
    assert node.create_publisher(String, "text", 7).qos_profile.depth == 7


def test_the_graph_shows_them(overridden, spin):
    node = overridden(publisher__reliability="best_effort", publisher__durability="transient_local")
    options = QoSOverridingOptions([QoSPolicyKind.RELIABILITY, QoSPolicyKind.DURABILITY])
    node.create_publisher(String, "text", 7, qos_overriding_options=options)
    assert spin(lambda: node.get_publishers_info_by_topic("text"), node)
    (info,) = node.get_publishers_info_by_topic("text")
    assert info.qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT
    assert info.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL


def test_subscriptions_have_no_lifespan(overridden):
    node = overridden(subscription_left__deadline=2_000_000)
    options = QoSOverridingOptions(
        [QoSPolicyKind.LIFESPAN, QoSPolicyKind.DEADLINE], entity_id="left"
    )
    subscription = node.create_subscription(
        String, "text", lambda _: None, 1, qos_overriding_options=options
    )
    assert subscription.qos_profile.deadline == Duration(nanoseconds=2_000_000)
    assert declared(node) == {"/ns/text.subscription_left.deadline": 2_000_000}


def test_callbacks_judge(overridden):
    node = overridden(publisher__depth=3)
    judged = []

    def judge(qos):
        judged.append(qos.depth)
        return QosCallbackResult(successful=qos.depth > 5, reason="too shallow")

    options = QoSOverridingOptions.with_default_policies(callback=judge)
    assert options.callback is judge
    with pytest.raises(InvalidQosOverridesError, match="too shallow"):
        node.create_publisher(String, "text", 7, qos_overriding_options=options)
    assert judged == [3]


def test_wrong_overrides(overridden):
    node = overridden(publisher__reliability="sometimes", subscription__depth="deep")
    with pytest.raises(RuntimeError, match="sometimes"):
        node.create_publisher(String, "text", 7, qos_overriding_options=DEFAULTS)
    with pytest.raises(ParameterException, match="deep"):
        node.create_subscription(String, "text", lambda _: None, 7, qos_overriding_options=DEFAULTS)


def test_profiles_must_be_known(node):
    qos = QoSProfile(depth=1, reliability=ReliabilityPolicy.UNKNOWN)
    with pytest.raises(ValueError, match="invalid"):
        node.create_publisher(String, "text", qos, qos_overriding_options=DEFAULTS)
