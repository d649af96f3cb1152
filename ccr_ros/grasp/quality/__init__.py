# SPDX-License-Identifier: Apache-2.0
"""How good a grasp is, from its contacts (docs/grasp_quality.md)."""

from .ball import Ball, ferrari_canny
from .closure import Closure, force_closure
from .compliance import Compliance, compliance_of
from .contact import FrictionContact, friction_margin
from .load import LargestLoad, largest_load
from .payload import SlipLoads, payload_until_slip
from .quality import GraspQuality, contacts_of, grasp_quality, quality_of
from .wrenches import wrench_in_words

__all__ = [
    "Ball",
    "Closure",
    "Compliance",
    "FrictionContact",
    "GraspQuality",
    "LargestLoad",
    "SlipLoads",
    "compliance_of",
    "contacts_of",
    "ferrari_canny",
    "force_closure",
    "friction_margin",
    "grasp_quality",
    "largest_load",
    "payload_until_slip",
    "quality_of",
    "wrench_in_words",
]
