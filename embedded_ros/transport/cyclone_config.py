# SPDX-License-Identifier: Apache-2.0
"""Cyclone DDS configuration from ROS's environment variables.

ROS_AUTOMATIC_DISCOVERY_RANGE (OFF, LOCALHOST, SUBNET, SYSTEM_DEFAULT), ROS_LOCALHOST_ONLY (older,
wins when 1) and ROS_STATIC_PEERS (addresses separated by ``;``) mean what they mean to ROS 2 Jazzy;
what
CYCLONEDDS_URI holds is applied last.
"""

from __future__ import annotations

import html
import os
import socket
import struct
import sys
from collections.abc import Mapping

RANGES = ("OFF", "LOCALHOST", "SUBNET", "SYSTEM_DEFAULT")

#: one port pair per participant index: how many participants of this machine can see each other
MAX_PARTICIPANTS = 99


# A closing writer waits this long for readers that do not acknowledge, as those of a killed process
# do not; the default of a second would add up over a node's writers.
_INTERNAL = "<Internal><WriterLingerDuration>30ms</WriterLingerDuration></Internal>"


class DiscoveryError(RuntimeError):
    """A discovery setting has a value that ROS does not know."""


def discovery_range(environ: Mapping[str, str]) -> str:
    """The discovery range asked for, SUBNET by default.

    :raises DiscoveryError: ROS_AUTOMATIC_DISCOVERY_RANGE has an unknown value.
    """
    if environ.get("ROS_LOCALHOST_ONLY", "0") == "1":
        return "LOCALHOST"
    wanted = environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "").upper() or "SUBNET"
    if wanted not in RANGES:
        raise DiscoveryError(
            f"ROS_AUTOMATIC_DISCOVERY_RANGE is {wanted!r}; it must be one of {', '.join(RANGES)}"
        )
    return wanted


def has_network() -> bool:
    """Whether an interface other than the loopback is up and has an IPv4 address (always True off
    Linux).
    """
    if not sys.platform.startswith("linux"):
        return True
    import fcntl

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        for _, name in socket.if_nameindex():
            request = struct.pack("256s", name.encode()[:15])
            try:
                flags = struct.unpack_from("<H", fcntl.ioctl(probe, 0x8913, request), 16)[0]
                fcntl.ioctl(probe, 0x8915, request)
            except OSError:
                continue
            up, loopback = flags & 0x1, flags & 0x8
            if up and not loopback:
                return True
    return False


def domain_xml(environ: Mapping[str, str] | None = None) -> str:
    """The configuration for the domain of this process, as Cyclone DDS reads it."""
    environ = os.environ if environ is None else environ
    wanted = discovery_range(environ)
    peers = [
        peer.strip() for peer in environ.get("ROS_STATIC_PEERS", "").split(";") if peer.strip()
    ]
    # Loopback interfaces have no multicast: without another one SUBNET would find nobody.
    local = wanted == "LOCALHOST" or (wanted == "SUBNET" and not peers and not has_network())
    fragments = []
    if local:
        interfaces = '<NetworkInterface address="127.0.0.1" multicast="false"/>'
        if peers:
            # Static peers may be other machines, which the loopback does not reach.
            interfaces = ""
        general = "<AllowMulticast>false</AllowMulticast>"
        if interfaces:
            general = f"<Interfaces>{interfaces}</Interfaces>" + general
        fragments.append(_fragment(general, _discovery(["127.0.0.1", *peers])))
    elif wanted == "OFF":
        general = "<AllowMulticast>false</AllowMulticast>"
        tag = f"<ParticipantIndex>none</ParticipantIndex><Tag>ros_discovery_off_{os.getpid()}</Tag>"
        fragments.append(_fragment(general, tag))
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
    general = f"<General>{general}</General>" if general else ""
    return (
        '<CycloneDDS><Domain Id="any">'
        f"{general}<Discovery>{discovery}</Discovery>{_INTERNAL}</Domain></CycloneDDS>"
    )
