# SPDX-License-Identifier: Apache-2.0
"""Moving an object that is held: pulls for a wanted shift or turn (docs/manipulation.md)."""

from .plan import MovePlan, Waypoint, move_steps, plan_move
from .target import MoveLimits, MoveTarget

__all__ = ["MoveLimits", "MovePlan", "MoveTarget", "Waypoint", "move_steps", "plan_move"]
