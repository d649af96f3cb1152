# SPDX-License-Identifier: Apache-2.0
"""A pull of a cable whose length at rest is not known yet, because it is what is designed."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Pull:
    """The pull of one cable: ``value`` [m], or that part of the cable's length at rest."""

    value: float
    relative: bool = False
