# SPDX-License-Identifier: Apache-2.0
"""Quality of service."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from enum import Enum, IntEnum
from operator import attrgetter
from typing import Any, NamedTuple

from embedded_ros.transport import INFINITE, Qos

from .duration import Duration, Infinite


class QoSPolicyKind(IntEnum):
    """Names of the policies, as incompatible-QoS events give them."""

    INVALID = 1 << 0
    DURABILITY = 1 << 1
    DEADLINE = 1 << 2
    LIVELINESS = 1 << 3
    RELIABILITY = 1 << 4
    HISTORY = 1 << 5
    LIFESPAN = 1 << 6
    DEPTH = 1 << 7
    LIVELINESS_LEASE_DURATION = 1 << 8
    AVOID_ROS_NAMESPACE_CONVENTIONS = 1 << 9


def qos_policy_name_from_kind(policy_kind: QoSPolicyKind | int) -> str:
    """The name of a policy kind."""
    return QoSPolicyKind(policy_kind).name


class InvalidQoSProfileException(Exception):
    """A profile says too little."""

    def __init__(self, *args: Any) -> None:
        super().__init__("Invalid QoSProfile", *args)


class QoSPolicyEnum(IntEnum):
    """Base of the policy values, with the short names that tools use."""

    @classmethod
    def short_keys(cls) -> list[str]:
        """All short names."""
        return [name.lower() for name in cls.__members__]

    @classmethod
    def get_from_short_key(cls, name: str) -> int:
        """The value of a short name."""
        return cls[name.upper()].value

    @property
    def short_key(self) -> str:
        """The short name."""
        return self.name.lower()


class HistoryPolicy(QoSPolicyEnum):
    """How many messages are kept."""

    SYSTEM_DEFAULT = 0
    KEEP_LAST = 1
    KEEP_ALL = 2
    UNKNOWN = 3


class ReliabilityPolicy(QoSPolicyEnum):
    """Whether lost messages are sent again."""

    SYSTEM_DEFAULT = 0
    RELIABLE = 1
    BEST_EFFORT = 2
    UNKNOWN = 3
    BEST_AVAILABLE = 4


class DurabilityPolicy(QoSPolicyEnum):
    """Whether late joiners get what was published before."""

    SYSTEM_DEFAULT = 0
    TRANSIENT_LOCAL = 1
    VOLATILE = 2
    UNKNOWN = 3
    BEST_AVAILABLE = 4


class LivelinessPolicy(QoSPolicyEnum):
    """How a publisher shows that it is alive."""

    SYSTEM_DEFAULT = 0
    AUTOMATIC = 1
    MANUAL_BY_TOPIC = 3
    UNKNOWN = 4
    BEST_AVAILABLE = 5


class _OldName:
    """A policy value under the name it had before; it warns."""

    def __init__(self, old: str, new: str) -> None:
        self._old, self._new = old, new

    def __get__(self, _: object, policy: type[QoSPolicyEnum]) -> QoSPolicyEnum:
        warnings.warn(f"{self._old} is deprecated. Use {self._new} instead.", stacklevel=2)
        return policy[self._new]


for _kind in (HistoryPolicy, ReliabilityPolicy, DurabilityPolicy, LivelinessPolicy):
    for _new in set(_kind.__members__) - {"BEST_AVAILABLE"}:
        _old = f"RMW_QOS_POLICY_{_kind.__name__.removesuffix('Policy').upper()}_{_new}"
        setattr(_kind, _old, _OldName(_old, _new))

QoSHistoryPolicy = HistoryPolicy
QoSReliabilityPolicy = ReliabilityPolicy
QoSDurabilityPolicy = DurabilityPolicy
QoSLivelinessPolicy = LivelinessPolicy

#: values that rmw reserves for "as strict as most peers allow"
DeadlineBestAvailable = Duration(nanoseconds=2**63 - 2)
LivelinessLeaseDurationeBestAvailable = Duration(nanoseconds=2**63 - 2)


def _check(condition: bool, text: str) -> None:
    if not condition:
        raise AssertionError(text)


def _policy(name: str, kind: type, convert: Callable[[Any], Any] = lambda value: value) -> Any:
    """The property of a policy, which takes values of `kind`."""
    slot = "_" + name

    def put(self: Any, value: Any) -> None:
        _check(isinstance(value, kind), f"{name} must be of type {kind.__name__}, got {value!r}")
        setattr(self, slot, convert(value))

    return property(attrgetter(slot), put, doc=f"The {name} policy.")


#: what a profile says when its maker does not; durations of zero are not specified
_DEFAULTS: dict[str, Any] = {
    "depth": 10,
    "reliability": ReliabilityPolicy.RELIABLE,
    "durability": DurabilityPolicy.VOLATILE,
    "lifespan": Duration(),
    "deadline": Duration(),
    "liveliness": LivelinessPolicy.SYSTEM_DEFAULT,
    "liveliness_lease_duration": Duration(),
    "avoid_ros_namespace_conventions": False,
}


class QoSProfile:
    """Policies of a publisher or subscription; ``depth`` or ``history`` must be given."""

    __slots__ = (  # noqa: RUF023 - the order in which profiles are printed
        "_history",
        "_depth",
        "_reliability",
        "_durability",
        "_lifespan",
        "_deadline",
        "_liveliness",
        "_liveliness_lease_duration",
        "_avoid_ros_namespace_conventions",
    )

    def __init__(self, **kwargs: Any) -> None:
        """Take policies by name; what is not given is as in ROS's default profile.

        :raises InvalidQoSProfileException: neither history nor depth is given, or KEEP_LAST without
            a depth.
        """
        unknown = [key for key in kwargs if "_" + key not in self.__slots__]
        _check(not unknown, f"Invalid arguments passed to constructor: {unknown}")
        if "history" not in kwargs:
            if "depth" not in kwargs:
                raise InvalidQoSProfileException("History and/or depth settings are required.")
            kwargs["history"] = HistoryPolicy.KEEP_LAST
        self.history = kwargs["history"]
        if self.history == HistoryPolicy.KEEP_LAST and "depth" not in kwargs:
            raise InvalidQoSProfileException("History set to KEEP_LAST without a depth setting.")
        for name, default in _DEFAULTS.items():
            setattr(self, name, kwargs.get(name, default))

    history = _policy("history", int, HistoryPolicy)
    reliability = _policy("reliability", int, ReliabilityPolicy)
    durability = _policy("durability", int, DurabilityPolicy)
    liveliness = _policy("liveliness", int, LivelinessPolicy)
    lifespan = _policy("lifespan", Duration)
    deadline = _policy("deadline", Duration)
    liveliness_lease_duration = _policy("liveliness_lease_duration", Duration)
    avoid_ros_namespace_conventions = _policy("avoid_ros_namespace_conventions", bool)

    @property
    def depth(self) -> int:
        """How many messages KEEP_LAST keeps."""
        return self._depth

    @depth.setter
    def depth(self, value: int) -> None:
        _check(isinstance(value, int), f"depth must be an int, got {value!r}")
        if self.history == HistoryPolicy.KEEP_LAST and value == 0:
            warnings.warn(
                "A zero depth with KEEP_LAST doesn't make sense; no data could be stored. "
                "This will be interpreted as SYSTEM_DEFAULT",
                stacklevel=3,
            )
        self._depth = value

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, QoSProfile):
            return False
        return all(getattr(self, slot) == getattr(other, slot) for slot in self.__slots__)

    __hash__ = None  # type: ignore[assignment]

    def __str__(self) -> str:
        policies = ", ".join(f"{slot[1:]}={getattr(self, slot)}" for slot in self.__slots__)
        return f"{type(self).__name__}({policies})"

    def get_c_qos_profile(self) -> rmw_qos_profile_t:
        """The policies as plain values; its ``to_dict()`` gives the arguments of this class."""
        return rmw_qos_profile_t(*(getattr(self, slot) for slot in self.__slots__))

    def decide(self, peers: list[Qos] | None = None, writer: bool = True) -> Qos:
        """This profile with every policy decided, for the transport.

        ``peers`` (endpoints of the other direction) settle BEST_AVAILABLE policies; none: the
        system's defaults.
        """
        peers = peers or []
        reliable = self.reliability != ReliabilityPolicy.BEST_EFFORT
        transient = self.durability == DurabilityPolicy.TRANSIENT_LOCAL
        if self.reliability == ReliabilityPolicy.BEST_AVAILABLE:
            # A reliable writer suits every reader; a reader must not ask for more than any writer
            # offers.
            reliable = writer or all(peer.reliable for peer in peers)
        if self.durability == DurabilityPolicy.BEST_AVAILABLE:
            transient = writer or (bool(peers) and all(peer.transient_local for peer in peers))
        return Qos(
            reliable=reliable,
            transient_local=transient,
            keep_all=self.history == HistoryPolicy.KEEP_ALL,
            depth=self.depth if self.depth > 0 else 1,
            deadline=_nanoseconds(self.deadline),
            lifespan=_nanoseconds(self.lifespan),
            manual_liveliness=self.liveliness == LivelinessPolicy.MANUAL_BY_TOPIC,
            liveliness_lease=_nanoseconds(self.liveliness_lease_duration),
        )

    @classmethod
    def of(cls, qos: Qos) -> QoSProfile:
        """The profile of a discovered endpoint."""
        return cls(
            history=HistoryPolicy.KEEP_ALL if qos.keep_all else HistoryPolicy.KEEP_LAST,
            depth=max(qos.depth, 0 if qos.keep_all else 1),
            reliability=ReliabilityPolicy.RELIABLE
            if qos.reliable
            else ReliabilityPolicy.BEST_EFFORT,
            durability=DurabilityPolicy.TRANSIENT_LOCAL
            if qos.transient_local
            else DurabilityPolicy.VOLATILE,
            lifespan=_duration(qos.lifespan),
            deadline=_duration(qos.deadline),
            liveliness=LivelinessPolicy.MANUAL_BY_TOPIC
            if qos.manual_liveliness
            else LivelinessPolicy.AUTOMATIC,
            liveliness_lease_duration=_duration(qos.liveliness_lease),
        )


class rmw_qos_profile_t(NamedTuple):
    """All policies of a profile."""

    history: HistoryPolicy
    depth: int
    reliability: ReliabilityPolicy
    durability: DurabilityPolicy
    lifespan: Duration
    deadline: Duration
    liveliness: LivelinessPolicy
    liveliness_lease_duration: Duration
    avoid_ros_namespace_conventions: bool

    def to_dict(self) -> dict[str, Any]:
        """The policies by name."""
        return self._asdict()

    @staticmethod
    def predefined(name: str) -> rmw_qos_profile_t:
        """The profile of that name in this module, such as ``qos_profile_sensor_data``."""
        profile: QoSProfile = globals()[name]
        return profile.get_c_qos_profile()


def _nanoseconds(duration: Duration) -> int:
    unset = duration.nanoseconds <= 0 or duration >= Infinite
    return INFINITE if unset or duration == DeadlineBestAvailable else duration.nanoseconds


def _duration(nanoseconds: int) -> Duration:
    return Infinite if nanoseconds >= INFINITE else Duration(nanoseconds=nanoseconds)


qos_profile_unknown = QoSProfile(
    history=HistoryPolicy.UNKNOWN,
    depth=0,
    reliability=ReliabilityPolicy.UNKNOWN,
    durability=DurabilityPolicy.UNKNOWN,
    liveliness=LivelinessPolicy.UNKNOWN,
)
qos_profile_default = QoSProfile(depth=10)
qos_profile_system_default = QoSProfile(
    history=HistoryPolicy.SYSTEM_DEFAULT,
    depth=0,
    reliability=ReliabilityPolicy.SYSTEM_DEFAULT,
    durability=DurabilityPolicy.SYSTEM_DEFAULT,
)
qos_profile_sensor_data = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
qos_profile_services_default = QoSProfile(depth=10)
qos_profile_parameters = QoSProfile(depth=1000)
qos_profile_parameter_events = QoSProfile(depth=1000)
qos_profile_best_available = QoSProfile(
    depth=10,
    reliability=ReliabilityPolicy.BEST_AVAILABLE,
    durability=DurabilityPolicy.BEST_AVAILABLE,
    liveliness=LivelinessPolicy.BEST_AVAILABLE,
    deadline=DeadlineBestAvailable,
    liveliness_lease_duration=LivelinessLeaseDurationeBestAvailable,
)
qos_profile_action_status_default = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class QoSPresetProfiles(Enum):
    """The predefined profiles."""

    UNKNOWN = qos_profile_unknown
    DEFAULT = qos_profile_default
    SYSTEM_DEFAULT = qos_profile_system_default
    SENSOR_DATA = qos_profile_sensor_data
    SERVICES_DEFAULT = qos_profile_services_default
    PARAMETERS = qos_profile_parameters
    PARAMETER_EVENTS = qos_profile_parameter_events
    ACTION_STATUS_DEFAULT = qos_profile_action_status_default
    BEST_AVAILABLE = qos_profile_best_available

    @classmethod
    def short_keys(cls) -> list[str]:
        """All short names."""
        return [name.lower() for name in cls.__members__]

    @classmethod
    def get_from_short_key(cls, name: str) -> QoSProfile:
        """The profile of a short name."""
        return cls[name.upper()].value


class QoSCompatibility(IntEnum):
    """Whether a publisher and a subscription can talk."""

    OK = 0
    WARNING = 1
    ERROR = 2


_LAX_AND_STRICT = {
    "reliability": (ReliabilityPolicy.BEST_EFFORT, ReliabilityPolicy.RELIABLE),
    "durability": (DurabilityPolicy.VOLATILE, DurabilityPolicy.TRANSIENT_LOCAL),
    "liveliness": (LivelinessPolicy.AUTOMATIC, LivelinessPolicy.MANUAL_BY_TOPIC),
}


def qos_check_compatible(
    publisher_qos: QoSProfile, subscription_qos: QoSProfile
) -> tuple[QoSCompatibility, str]:
    """Whether a publisher and a subscription with these profiles can talk, and why not.

    The answer is WARNING where a policy that matters is left to the middleware.
    """
    errors, doubts = "", ""
    for name, (lax, strict) in _LAX_AND_STRICT.items():
        pub, sub = getattr(publisher_qos, name), getattr(subscription_qos, name)
        pub_open, sub_open = (p.name in ("SYSTEM_DEFAULT", "UNKNOWN") for p in (pub, sub))
        text = f"{name} of the publisher is {pub.short_key}, of the subscription {sub.short_key};"
        if (pub, sub) == (lax, strict):
            errors += "ERROR: " + text
        elif (pub_open or pub == lax) and (sub_open or sub == strict):
            doubts += "WARNING: " + text
    for name in ("deadline", "liveliness_lease_duration"):
        pub, sub = getattr(publisher_qos, name), getattr(subscription_qos, name)
        if _nanoseconds(pub) > _nanoseconds(sub):
            errors += f"ERROR: {name} of the publisher is {pub}, of the subscription {sub};"
    if errors:
        return QoSCompatibility.ERROR, errors
    return (QoSCompatibility.WARNING if doubts else QoSCompatibility.OK), doubts
