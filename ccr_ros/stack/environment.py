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
    """Return a ROS domain, chosen by chance, that nobody on this machine seems to be in."""
    domains = random.sample(DOMAINS, len(DOMAINS))
    return next(filter(is_free, domains), domains[0])


def is_free(domain: int) -> bool:
    """Tell whether nobody on this machine seems to be in a ROS domain."""
    # The participants of a domain take these ports in turn (DDSI-RTPS 2.5, section 9.6.1); the
    # first of them may have left.
    for participant in range(_PROBED):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(("", 7400 + 250 * domain + 10 + 2 * participant))
            except OSError:
                return False
    return True
