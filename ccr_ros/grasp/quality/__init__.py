# SPDX-License-Identifier: Apache-2.0
"""How good a grasp is, from its contacts (docs/grasp_quality.md)."""

from .ball import Ball, ferrari_canny
from .closure import Closure, force_closure
from .contact import FrictionContact, friction_margin
from .load import LargestLoad, largest_load
from .quality import GraspQuality, contacts_of, grasp_quality, quality_of
from .wrenches import wrench_in_words

__all__ = [
    "Ball",
    "Closure",
    "FrictionContact",
    "GraspQuality",
    "LargestLoad",
    "contacts_of",
    "ferrari_canny",
    "force_closure",
    "friction_margin",
    "grasp_quality",
    "largest_load",
    "quality_of",
    "wrench_in_words",
]
