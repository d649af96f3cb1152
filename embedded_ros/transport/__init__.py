# SPDX-License-Identifier: Apache-2.0
"""The seam between rclpy and the middleware.

Everything above talks to the classes of :mod:`.base`; this file is the one place that chooses a
middleware: Cyclone DDS, or the transport within one process where there is none. The environment
variable EMBEDDED_ROS_TRANSPORT decides otherwise.
"""

from __future__ import annotations

import importlib.util
import os
import platform
import sys

from .base import INFINITE, Endpoint, Participant, Qos, Reader, Sample, StatusChange, Waiter, Writer

__all__ = [
    "CYCLONE_REQUIREMENT",
    "INFINITE",
    "TRANSPORTS",
    "Endpoint",
    "Participant",
    "Qos",
    "Reader",
    "Sample",
    "StatusChange",
    "Waiter",
    "Writer",
    "available_transports",
    "chosen_transport",
    "open_participant",
]

VARIABLE = "EMBEDDED_ROS_TRANSPORT"
CYCLONE_REQUIREMENT = "cyclonedds>=11.0.1,<11.1"

#: the names by which EMBEDDED_ROS_TRANSPORT calls the transports, and by which rclpy does
TRANSPORTS = {"cyclone": "rmw_cyclonedds_cpp", "local": "embedded_local"}

_said = False


def available_transports() -> list[str]:
    """The transports that this machine has, best first."""
    try:
        found = importlib.util.find_spec("cyclonedds") is not None
    except ImportError:  # an import hook forbids it
        found = False
    return ["cyclone", "local"] if found else ["local"]


def chosen_transport() -> str:
    """The transport in use, ``cyclone`` or ``local``.

    :raises ValueError: EMBEDDED_ROS_TRANSPORT is neither of them, or asks for what is not there.
    """
    wanted = os.environ.get(VARIABLE, "").strip()
    available = available_transports()
    if not wanted:
        return available[0]
    if wanted not in TRANSPORTS:
        raise ValueError(f"{VARIABLE} is {wanted!r}; it must be one of {', '.join(TRANSPORTS)}")
    if wanted not in available:
        raise ValueError(f"{VARIABLE} is {wanted!r}, but {_how_to_get_cyclone()}")
    return wanted


def open_participant(domain_id: int) -> Participant:
    """Join a domain.

    :raises ValueError: as for :func:`chosen_transport`.
    """
    if chosen_transport() == "local":
        from .cyclone_config import discovery_range
        from .local import LocalParticipant

        discovery_range(os.environ)  # without effect here, but a mistake all the same
        _say_what_is_missing()
        return LocalParticipant(domain_id)
    from .cyclone import CycloneParticipant

    return CycloneParticipant(domain_id)


def _say_what_is_missing() -> None:
    global _said
    if not _said:
        _said = True
        forced = os.environ.get(VARIABLE, "").strip()
        why = f"{VARIABLE} is {forced!r}" if forced else _how_to_get_cyclone()
        print(
            f"embedded_ros: nodes reach each other within this process only, as {why}",
            file=sys.stderr,
            flush=True,
        )


def _how_to_get_cyclone() -> str:
    """Why there is no cyclonedds, and what helps, within a sentence."""
    # The same condition as in setup.py.
    machine, version = platform.machine(), tuple(map(int, platform.python_version_tuple()[:2]))
    has_wheel = version < (3, 14) and (sys.platform == "darwin" or machine in ("x86_64", "AMD64"))
    if has_wheel and platform.python_implementation() == "CPython":
        return (
            "cyclonedds is not installed; "
            f"run: {sys.executable} -m pip install '{CYCLONE_REQUIREMENT}'"
        )
    return (
        f"there is no wheel of cyclonedds for {platform.python_implementation()} "
        f"{version[0]}.{version[1]} on {platform.system()} {machine} (but for CPython 3.11 "
        "to 3.13 on macOS and on x86-64); ROS 2 itself serves as well"
    )
