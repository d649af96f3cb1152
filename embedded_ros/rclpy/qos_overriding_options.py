# SPDX-License-Identifier: Apache-2.0
"""QoS policies that parameters ``qos_overrides.<topic>...`` may set."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult

from .duration import Duration
from .exceptions import ParameterAlreadyDeclaredException
from .publisher import Publisher
from .qos import QoSPolicyEnum, QoSPolicyKind, QoSProfile
from .subscription import Subscription

if TYPE_CHECKING:
    from .node import Node

QosCallbackResult = SetParametersResult
QosCallbackType = Callable[[QoSProfile], Any]


class InvalidQosOverridesError(Exception):
    """The callback of the options refused the profile."""


class QoSOverridingOptions:
    """Which policies of a publisher or subscription parameters may set."""

    def __init__(
        self,
        policy_kinds: Iterable[QoSPolicyKind],
        *,
        callback: QosCallbackType | None = None,
        entity_id: str | None = None,
    ) -> None:
        """Choose the policies.

        :param callback: judges the resulting profile by returning a QosCallbackResult.
        :param entity_id: tells entities of one topic apart in the parameters' names.
        """
        self.policy_kinds = policy_kinds
        self.callback = callback
        self.entity_id = entity_id

    @classmethod
    def with_default_policies(
        cls, *, callback: QosCallbackType | None = None, entity_id: str | None = None
    ) -> QoSOverridingOptions:
        """History, depth and reliability."""
        kinds = (QoSPolicyKind.HISTORY, QoSPolicyKind.DEPTH, QoSPolicyKind.RELIABILITY)
        return cls(kinds, callback=callback, entity_id=entity_id)


def _get_qos_policy_parameter(qos: QoSProfile, policy: QoSPolicyKind) -> str | int | bool:
    """A policy as a parameter value."""
    value: Any = getattr(qos, policy.name.lower())
    if isinstance(value, QoSPolicyEnum):
        if value.name == "UNKNOWN":
            raise ValueError(f"User provided QoS profile is invalid: its {policy.name} is UNKNOWN")
        return value.short_key
    return value.nanoseconds if isinstance(value, Duration) else value


def _override_qos_policy(qos: QoSProfile, policy: QoSPolicyKind, value: Any) -> None:
    """Set a policy to a parameter value."""
    name = policy.name.lower()
    present = getattr(qos, name)
    if isinstance(present, QoSPolicyEnum):
        allowed = type(present).short_keys()
        if str(value).lower() not in allowed:
            raise RuntimeError(
                f"Unexpected QoS override for policy `{name}`: `{value}`; allowed: "
                + ", ".join(allowed)
            )
        value = type(present).get_from_short_key(value)
    elif isinstance(present, Duration):
        value = Duration(nanoseconds=value)
    setattr(qos, name, value)


def _declare_qos_parameters(
    entity_type: type[Publisher | Subscription],
    node: Node,
    topic_name: str,
    qos: QoSProfile,
    options: QoSOverridingOptions,
) -> None:
    """Declare the parameters, with the profile's policies as defaults, and apply their values.

    :raises InvalidQosOverridesError: the options' callback refuses the result.
    :raises RuntimeError: a parameter has a value that its policy does not know.
    """
    kind = "publisher" if issubclass(entity_type, Publisher) else "subscription"
    suffix = "" if options.entity_id is None else f"_{options.entity_id}"
    whose = f"for {kind} `{topic_name}` with id `{options.entity_id}`"
    for policy in options.policy_kinds:
        if policy == QoSPolicyKind.LIFESPAN and kind == "subscription":
            continue
        name = f"qos_overrides.{topic_name}.{kind}{suffix}.{policy.name.lower()}"
        descriptor = ParameterDescriptor(
            description=f"{policy.name.lower()} {whose}", read_only=True
        )
        with contextlib.suppress(ParameterAlreadyDeclaredException):
            node.declare_parameter(name, _get_qos_policy_parameter(qos, policy), descriptor)
        _override_qos_policy(qos, policy, node.get_parameter(name).value)
    if options.callback is not None:
        result = options.callback(qos)
        if not result.successful:
            raise InvalidQosOverridesError(
                f"Provided QoS overrides {whose}, are not valid: {result.reason}"
            )
