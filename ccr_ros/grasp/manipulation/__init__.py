# SPDX-License-Identifier: Apache-2.0
"""Moving an object that is held: pulls for a wanted shift or turn (docs/manipulation.md)."""

from .plan import MoveLimits, MovePlan, MoveTarget, Waypoint, plan_move

__all__ = ["MoveLimits", "MovePlan", "MoveTarget", "Waypoint", "plan_move"]
