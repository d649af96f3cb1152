# SPDX-License-Identifier: Apache-2.0
"""Cyclone DDS configuration from ROS's environment variables.

ROS_AUTOMATIC_DISCOVERY_RANGE (OFF, LOCALHOST, SUBNET, SYSTEM_DEFAULT), ROS_LOCALHOST_ONLY (older;
when 1 the other two are ignored) and ROS_STATIC_PEERS (addresses separated by ``;``) mean what they
mean to ROS 2 Jazzy; what CYCLONEDDS_URI holds is applied last.
"""

from __future__ import annotations

import html
import os
from collections.abc import Mapping

RANGES = ("OFF", "LOCALHOST", "SUBNET", "SYSTEM_DEFAULT")

VARIABLES = (
    "ROS_AUTOMATIC_DISCOVERY_RANGE",
    "ROS_LOCALHOST_ONLY",
    "ROS_STATIC_PEERS",
    "CYCLONEDDS_URI",
)

#: one port pair per participant index: how many participants of this machine can see each other
MAX_PARTICIPANTS = 99

# A closing writer waits this long for readers that do not acknowledge, as those of a killed process
# do not; the default of a second would add up over a node's writers.
_INTERNAL = "<Internal><WriterLingerDuration>30ms</WriterLingerDuration></Internal>"

# Others forget a process that was killed when they have heard nothing of it for so long (by default
# ten seconds). Cyclone's own threads report in, so a busy interpreter does not look dead.
_LEASE = "<LeaseDuration>4s</LeaseDuration><SPDPInterval>1s</SPDPInterval>"

# By default Cyclone 11 gives up an address where nobody answered for 30 s. ROS 2 nodes (0.10) that
# start there later would never be found, nor find this process.
_PATIENT = "<InitialLocatorPruneDelay>inf</InitialLocatorPruneDelay>"

_UNICAST = "<General><AllowMulticast>false</AllowMulticast></General>"


class DiscoveryError(RuntimeError):
    """A discovery setting has a value that ROS does not know."""


def discovery_range(environ: Mapping[str, str]) -> str:
    """The discovery range asked for, SUBNET by default.

    :raises DiscoveryError: ROS_AUTOMATIC_DISCOVERY_RANGE has an unknown value.
    """
    if _localhost_only(environ):
        return "LOCALHOST"
    wanted = environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "").upper() or "SUBNET"
    if wanted not in RANGES:
        raise DiscoveryError(
            f"ROS_AUTOMATIC_DISCOVERY_RANGE is {wanted!r}; it must be one of {', '.join(RANGES)}"
        )
    return wanted


def _localhost_only(environ: Mapping[str, str]) -> bool:
    return environ.get("ROS_LOCALHOST_ONLY", "").startswith("1")


def settings_in_use(environ: Mapping[str, str] = os.environ) -> str:
    """The variables that shape the configuration, for error messages: `` with NAME='value'``."""
    given = [f"{name}={environ[name]!r}" for name in VARIABLES if environ.get(name)]
    return " with " + ", ".join(given) if given else ""


def domain_xml(environ: Mapping[str, str] | None = None) -> str:
    """The configuration for the domain of this process, as Cyclone DDS reads it."""
    environ = os.environ if environ is None else environ
    wanted = discovery_range(environ)
    given = "" if _localhost_only(environ) else environ.get("ROS_STATIC_PEERS", "")
    peers = [peer.strip() for peer in given.split(";") if peer.strip()]
    fragments = []
    if wanted == "LOCALHOST":
        # The interface is left to Cyclone as rmw_cyclonedds_cpp does: bound to the loopback, a
        # process would miss those of this machine that are on the network.
        fragments.append(_fragment(_UNICAST, _discovery(["127.0.0.1", *peers])))
    elif wanted == "OFF":
        tag = f"<ParticipantIndex>none</ParticipantIndex><Tag>ros_discovery_off_{os.getpid()}</Tag>"
        fragments.append(_fragment(_UNICAST, tag))
    elif wanted == "SUBNET":
        fragments.append(_fragment("", _discovery(peers)))
    if environ.get("CYCLONEDDS_URI"):
        fragments.append(environ["CYCLONEDDS_URI"])
    return ",".join(fragments)


def _discovery(peers: list[str]) -> str:
    text = (
        "<ParticipantIndex>auto</ParticipantIndex>"
        f"<MaxAutoParticipantIndex>{MAX_PARTICIPANTS}</MaxAutoParticipantIndex>"
    )
    if peers:
        text += (
            "<Peers>" + "".join(f'<Peer address="{html.escape(p)}"/>' for p in peers) + "</Peers>"
        )
    return text


def _fragment(general: str, discovery: str) -> str:
    return (
        '<CycloneDDS><Domain Id="any">'
        f"{general}<Discovery>{discovery}{_LEASE}{_PATIENT}</Discovery>{_INTERNAL}"
        "</Domain></CycloneDDS>"
    )
