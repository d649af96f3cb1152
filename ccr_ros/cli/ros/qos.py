# SPDX-License-Identifier: Apache-2.0
"""Quality of service on the command line."""

from __future__ import annotations

import argparse
import copy
import sys
from typing import Any

from ccr_ros.cli.ros.verbs import natural, positive_float
from ccr_ros.model.errors import UnknownName

_POLICIES = {
    "history": "QoSHistoryPolicy",
    "reliability": "QoSReliabilityPolicy",
    "durability": "QoSDurabilityPolicy",
    "liveliness": "QoSLivelinessPolicy",
}


def add_qos_arguments(parser: argparse.ArgumentParser, profile: str) -> None:
    """Declare the options that choose a QoS profile; `profile` is the default."""
    group = parser.add_argument_group("quality of service")
    group.add_argument(
        "--qos-profile",
        metavar="NAME",
        default=profile,
        help=f"profile to start from: default, sensor_data, ... (default: {profile})",
    )
    group.add_argument("--qos-depth", metavar="N", type=natural, help="messages that are kept")
    group.add_argument("--qos-history", metavar="NAME", help="keep_last or keep_all")
    group.add_argument("--qos-reliability", metavar="NAME", help="reliable or best_effort")
    group.add_argument("--qos-durability", metavar="NAME", help="volatile or transient_local")
    group.add_argument("--qos-liveliness", metavar="NAME", help="automatic or manual_by_topic")
    group.add_argument(
        "--qos-liveliness-lease-duration-seconds", metavar="SECONDS", type=positive_float
    )


def profile_of(args: argparse.Namespace) -> Any:
    """Return the profile that the options ask for.

    Raises:
        UnknownName: a profile or policy is not among the valid ones, which it lists.
    """
    import rclpy.qos
    from rclpy.duration import Duration

    # A copy: rclpy hands out the one object that everybody gets.
    profile = copy.copy(_by_key("profile", rclpy.qos.QoSPresetProfiles, args.qos_profile))
    for policy, kind in _POLICIES.items():
        key = getattr(args, f"qos_{policy}")
        if key is not None:
            setattr(profile, policy, _by_key(policy, getattr(rclpy.qos, kind), key))
    if args.qos_liveliness_lease_duration_seconds is not None:
        profile.liveliness_lease_duration = Duration(
            seconds=args.qos_liveliness_lease_duration_seconds
        )
    if args.qos_depth is not None:
        profile.depth = args.qos_depth
    elif profile.durability == rclpy.qos.QoSDurabilityPolicy.TRANSIENT_LOCAL and not profile.depth:
        profile.depth = 1
    return profile


def _by_key(what: str, kind: Any, key: str) -> Any:
    if key.lower() not in kind.short_keys():
        raise UnknownName(f"QoS {what}", key, kind.short_keys())
    return kind.get_from_short_key(key)


def profile_for_publishers(node: Any, topic: str, args: argparse.Namespace) -> Any:
    """Return a profile that gets the messages of all publishers of a topic.

    It asks for reliable and for transient-local delivery if every publisher offers it, unless the
    options say otherwise.
    """
    from rclpy.qos import QoSDurabilityPolicy, QoSReliabilityPolicy

    profile = profile_of(args)
    publishers = node.get_publishers_info_by_topic(topic)
    explicit = any(
        value is not None
        for name, value in vars(args).items()
        if name.startswith("qos_") and name != "qos_profile"
    )
    if explicit or not publishers:
        return profile
    for policy, more, less in (
        ("reliability", QoSReliabilityPolicy.RELIABLE, QoSReliabilityPolicy.BEST_EFFORT),
        ("durability", QoSDurabilityPolicy.TRANSIENT_LOCAL, QoSDurabilityPolicy.VOLATILE),
    ):
        offering = sum(getattr(one.qos_profile, policy) == more for one in publishers)
        setattr(profile, policy, more if offering == len(publishers) else less)
        if 0 < offering < len(publishers):
            print(
                f"Some, but not all, publishers are offering {policy} {more.name}. "
                f"Falling back to {less.name} as it will connect to all publishers",
                file=sys.stderr,
            )
    return profile
