# SPDX-License-Identifier: Apache-2.0
"""A ROS graph of the demo's own, so that it neither disturbs others nor is disturbed."""

from __future__ import annotations

import os
import random
import socket
from collections.abc import Mapping
from pathlib import Path

import ccr_ros

# Higher domains' ports reach into the range that systems give to outgoing connections.
DOMAINS = range(1, 101)
_PROBED = 10  # participants
# A port that would be the 120th participant's says that somebody has chosen the domain, and not
# entered it yet or again: demos and tests that start at the same moment stay apart.
_MARK = 249


def graph_environment(environ: Mapping[str, str]) -> dict[str, str]:
    """Return the variables to set: a free domain and this machine only, unless they are given."""
    out = {}
    if not environ.get("ROS_DOMAIN_ID", "").strip():
        out["ROS_DOMAIN_ID"] = str(free_domain())
    if not (environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE") or environ.get("ROS_LOCALHOST_ONLY")):
        out["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    return out


def import_environment(environ: Mapping[str, str]) -> dict[str, str]:
    """Return the variables with which child processes import this very ccr_ros."""
    here = str(Path(ccr_ros.__file__).parents[1])
    return {"PYTHONPATH": os.pathsep.join(filter(None, [here, environ.get("PYTHONPATH")]))}


def free_domain() -> int:
    """Return a ROS domain, chosen by chance, that nobody on this machine seems to be in.

    It stays marked until this process ends, so that others who ask do not get it.
    """
    domains = random.sample(DOMAINS, len(DOMAINS))
    for domain in domains:
        mark = _bind(domain, _MARK)
        if mark is None:
            continue
        if _is_empty(domain):
            mark.detach()  # stays open until the process ends
            return domain
        mark.close()
    return domains[0]


def is_free(domain: int) -> bool:
    """Tell whether nobody on this machine seems to be in a ROS domain, or to have chosen it."""
    return _is_unbound(domain, _MARK) and _is_empty(domain)


def _is_empty(domain: int) -> bool:
    # The participants of a domain take these ports in turn (DDSI-RTPS 2.5, section 9.6.1); the
    # first of them may have left.
    return all(_is_unbound(domain, 10 + 2 * participant) for participant in range(_PROBED))


def _is_unbound(domain: int, offset: int) -> bool:
    bound = _bind(domain, offset)
    if bound is not None:
        bound.close()
    return bound is not None


def _bind(domain: int, offset: int) -> socket.socket | None:
    """Return a socket at one of a domain's 250 ports, None where it is taken."""
    bound = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        bound.bind(("", 7400 + 250 * domain + offset))
    except OSError:
        bound.close()
        return None
    return bound
