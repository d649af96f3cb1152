# SPDX-License-Identifier: Apache-2.0
"""QoS profiles as values and as set by parameters, and the events of peers."""

import pytest
from rclpy.duration import Duration
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSPolicyKind,
    QoSPresetProfiles,
    QoSProfile,
    ReliabilityPolicy,
    qos_check_compatible,
    qos_profile_sensor_data,
)
from std_msgs.msg import Float64, String


@pytest.mark.parametrize(
    "profile",
    [
        QoSProfile(depth=7),
        QoSProfile(
            history=HistoryPolicy.KEEP_ALL,
            depth=2,
            reliability=ReliabilityPolicy.BEST_EFFORT,
            durability=DurabilityPolicy.TRANSIENT_LOCAL,
            lifespan=Duration(seconds=5),
            deadline=Duration(nanoseconds=1),
            liveliness=LivelinessPolicy.MANUAL_BY_TOPIC,
            liveliness_lease_duration=Duration(seconds=1),
            avoid_ros_namespace_conventions=True,
        ),
        *(preset.value for preset in QoSPresetProfiles),
    ],
)
def test_profiles_survive_a_dictionary(profile):
    policies = profile.get_c_qos_profile().to_dict()
    assert set(policies) == {slot[1:] for slot in QoSProfile.__slots__}
    assert QoSProfile(**policies) == profile


DECIDED = {"depth": 1, "liveliness": LivelinessPolicy.AUTOMATIC}


@pytest.mark.parametrize(
    ("publisher", "subscription", "expected"),
    [
        ({}, {}, "OK"),
        ({"reliability": ReliabilityPolicy.BEST_EFFORT}, {}, "ERROR"),
        ({}, {"durability": DurabilityPolicy.TRANSIENT_LOCAL}, "ERROR"),
        ({}, {"liveliness": LivelinessPolicy.MANUAL_BY_TOPIC}, "ERROR"),
        ({}, {"deadline": Duration(seconds=1)}, "ERROR"),
        ({"deadline": Duration(seconds=1)}, {}, "OK"),
        ({"deadline": Duration(seconds=2)}, {"deadline": Duration(seconds=1)}, "ERROR"),
        ({}, {"liveliness_lease_duration": Duration(seconds=1)}, "ERROR"),
        ({"reliability": ReliabilityPolicy.SYSTEM_DEFAULT}, {}, "WARNING"),
        ({}, {"reliability": ReliabilityPolicy.SYSTEM_DEFAULT}, "OK"),
        ({"durability": DurabilityPolicy.SYSTEM_DEFAULT}, {}, "OK"),
        ({}, {"durability": DurabilityPolicy.UNKNOWN}, "WARNING"),
        ({}, {"liveliness": LivelinessPolicy.SYSTEM_DEFAULT}, "WARNING"),
    ],
)
def test_compatibility_is_judged_before_anything_is_made(publisher, subscription, expected):
    profiles = [QoSProfile(**{**DECIDED, **policies}) for policies in (publisher, subscription)]
    compatibility, reason = qos_check_compatible(*profiles)
    assert compatibility.name == expected
    assert bool(reason) == (expected != "OK")


def test_matched_events_count_peers(node, spin):
    joined, heard = [], []
    publisher = node.create_publisher(
        String, "text", 1, event_callbacks=PublisherEventCallbacks(matched=joined.append)
    )
    subscription = node.create_subscription(
        String, "text", print, 1, event_callbacks=SubscriptionEventCallbacks(matched=heard.append)
    )
    assert spin(lambda: joined and heard, node)
    for info in (joined[-1], heard[-1]):
        assert (info.total_count, info.total_count_change) == (1, 1)
        assert (info.current_count, info.current_count_change) == (1, 1)
    node.destroy_subscription(subscription)
    assert spin(lambda: len(joined) == 2, node)
    assert (joined[-1].total_count, joined[-1].total_count_change) == (1, 0)
    assert (joined[-1].current_count, joined[-1].current_count_change) == (0, -1)
    assert publisher.get_subscription_count() == 0


def test_refused_peers_are_told_of(node, spin):
    refusals, refused = [], []
    node.create_publisher(
        String,
        "text",
        qos_profile_sensor_data,
        event_callbacks=PublisherEventCallbacks(incompatible_qos=refusals.append),
    )
    node.create_subscription(
        String,
        "text",
        print,
        1,
        event_callbacks=SubscriptionEventCallbacks(incompatible_qos=refused.append),
    )
    assert spin(lambda: refusals and refused, node)
    for info in (refusals[0], refused[0]):
        assert (info.total_count, info.total_count_change) == (1, 1)
        assert info.last_policy_kind == QoSPolicyKind.RELIABILITY


@pytest.mark.not_fast_dds("tells of no liveliness when a publisher is found")
def test_liveliness_and_deadline_events(node, spin):
    alive, missed = [], []
    callbacks = SubscriptionEventCallbacks(liveliness=alive.append, deadline=missed.append)
    profile = QoSProfile(depth=1, deadline=Duration(seconds=0.2))
    node.create_subscription(Float64, "rate", print, profile, event_callbacks=callbacks)
    publisher = node.create_publisher(Float64, "rate", profile)
    assert spin(lambda: alive, node)
    assert (alive[0].alive_count, alive[0].alive_count_change) == (1, 1)
    assert (alive[0].not_alive_count, alive[0].not_alive_count_change) == (0, 0)
    publisher.publish(Float64())
    assert spin(lambda: missed, node)
    assert missed[0].total_count == missed[0].total_count_change > 0
    node.destroy_publisher(publisher)
    assert spin(lambda: alive[-1].alive_count == 0, node)


def test_default_callbacks_can_be_left_out(node):
    for use, expected in ((True, 2), (False, 0)):
        callbacks = PublisherEventCallbacks(use_default_callbacks=use)
        publisher = node.create_publisher(String, "text", 1, event_callbacks=callbacks)
        assert len(publisher.event_handlers) == expected


@pytest.mark.parametrize(
    ("policy", "old", "new"),
    [
        (HistoryPolicy, "RMW_QOS_POLICY_HISTORY_KEEP_LAST", "KEEP_LAST"),
        (ReliabilityPolicy, "RMW_QOS_POLICY_RELIABILITY_BEST_EFFORT", "BEST_EFFORT"),
        (DurabilityPolicy, "RMW_QOS_POLICY_DURABILITY_TRANSIENT_LOCAL", "TRANSIENT_LOCAL"),
        (LivelinessPolicy, "RMW_QOS_POLICY_LIVELINESS_AUTOMATIC", "AUTOMATIC"),
    ],
)
def test_old_names_of_policy_values_warn(policy, old, new):
    with pytest.warns(UserWarning, match=f"{old} is deprecated"):
        assert getattr(policy, old) is policy[new]
