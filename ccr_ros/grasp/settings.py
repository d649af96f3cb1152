# SPDX-License-Identifier: Apache-2.0
"""What can be set about grasping: every value with its meaning, its range and a default.

The coordinator node declares a parameter for each field, with this text and range.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any

from ccr_ros.model import checks


def _setting(default: float, low: float, high: float, unit: str, text: str) -> Any:
    return field(
        default=default, metadata={"low": low, "high": high, "unit": unit, "text": f"{text}"}
    )


@dataclass(frozen=True)
class GraspSettings:
    """Speeds [m/s] are of the cable that moves most, forces [N] the sum over a finger's contacts.

    The defaults are for the sphere gripper.

    Raises:
        InvalidValue: A value is out of its range, or default_force is beyond max_force.
    """

    open_speed: float = _setting(
        0.004, 1e-5, 0.1, "m/s", "Speed at which the fingers go open before a grasp."
    )
    close_speed: float = _setting(
        0.001, 1e-5, 0.1, "m/s", "Speed at which they close, when the goal says none."
    )
    slow_release_speed: float = _setting(
        0.001, 1e-5, 0.1, "m/s", "Speed of a release that is not fast."
    )
    fast_release_speed: float = _setting(0.005, 1e-5, 0.1, "m/s", "Speed of a fast release.")
    default_force: float = _setting(
        0.2, 1e-3, 1e3, "N", "Target force of each finger, when the goal says none."
    )
    max_force: float = _setting(0.5, 1e-3, 1e3, "N", "Goals with a larger target are rejected.")
    approach_margin: float = _setting(
        0.02,
        0.0,
        1.0,
        "m",
        "With an expected width, fingers go as fast as they open up to this much before it.",
    )
    contact_force: float = _setting(
        0.005, 1e-6, 1e3, "N", "A finger touches when its contact force is at least this."
    )
    touch_force: float = _setting(
        0.02, 1e-6, 1e3, "N", "Force at which fingers that touch first wait for the others."
    )
    effort_margin: float = _setting(
        0.1,
        0.0,
        1e3,
        "N",
        "The effort agrees when the tension is beyond that of the free finger by at least this.",
    )
    force_tolerance: float = _setting(
        0.02, 1e-6, 1e3, "N", "The target force is reached when it is missed by at most this."
    )
    press_rate: float = _setting(
        0.2, 1e-4, 1e3, "N/s", "Rate at which all fingers together raise their force."
    )
    force_gain: float = _setting(
        0.003, 1e-6, 1.0, "m/(N s)", "Gain of the force regulation; see docs/grasping.md."
    )
    force_speed: float = _setting(
        0.0005, 1e-6, 0.1, "m/s", "Fastest motion of the force regulation."
    )
    force_dead_band: float = _setting(
        0.002, 0.0, 1e3, "N", "Differences of force that the regulation lets be."
    )
    blind_lead: float = _setting(
        0.0003,
        1e-5,
        0.1,
        "m",
        "Farthest that fingers close ahead of the newest solved pose: what they press on unawares.",
    )
    max_lead: float = _setting(
        0.002, 1e-5, 0.1, "m", "Farthest that a command is ahead of the measured pull."
    )
    place_tolerance: float = _setting(
        0.0002, 1e-6, 0.01, "m", "A pull is where it was sent when it is off by at most this."
    )
    settle_time: float = _setting(
        0.3, 0.0, 10.0, "s", "Time for which what ends a motion must hold."
    )
    stall_time: float = _setting(
        1.0, 0.05, 60.0, "s", "Without progress for so long, a finger has stalled."
    )
    loss_time: float = _setting(
        2.0, 0.05, 60.0, "s", "Without touch of a required finger for so long, the object is lost."
    )
    bridge_timeout: float = _setting(
        0.8, 0.05, 60.0, "s", "Without measured pulls for so long, the servo bridge is silent."
    )
    solver_timeout: float = _setting(
        0.8, 0.05, 60.0, "s", "Without a finger's state for so long, the solver is silent."
    )
    stale_timeout: float = _setting(
        0.8, 0.05, 60.0, "s", "With a stale state for so long, the pose is not known."
    )
    grasp_timeout: float = _setting(
        30.0, 0.1, 3600.0, "s", "Longest time of a grasp, when the goal says none."
    )
    release_timeout: float = _setting(
        20.0,
        0.1,
        3600.0,
        "s",
        "Longest time of opening the fingers, at a release or before a grasp.",
    )
    hold_margin: float = _setting(
        0.0,
        0.0,
        0.95,
        "1",
        "While holding, the force is raised by what keeps the smallest friction margin of the "
        "contacts at least this, as long as the solver tells of it; 0: it is not.",
    )
    margin_gain: float = _setting(
        0.3, 1e-4, 1e3, "N/s", "Rate at which it is raised, per missing margin."
    )
    margin_band: float = _setting(
        0.05, 0.0, 0.5, "1", "Margin beyond hold_margin from which on it is lowered again."
    )
    move_speed: float = _setting(
        0.0005, 1e-6, 0.1, "m/s", "Speed of a motion of the object, when the goal says none."
    )
    move_lead: float = _setting(
        0.00015, 1e-6, 0.1, "m", "Farthest that its commands are ahead of the newest solved pose."
    )
    move_stop_margin: float = _setting(
        0.02, 0.0, 0.95, "1", "A motion ends where the smallest friction margin is below this."
    )
    move_shift_tolerance: float = _setting(
        0.0005, 1e-6, 0.1, "m", "The object is where it shall be when it is off by at most this."
    )
    move_turn_tolerance: float = _setting(
        0.02, 1e-5, 1.0, "rad", "And when it is turned as far as asked within this."
    )
    plan_timeout: float = _setting(
        90.0, 0.1, 3600.0, "s", "Longest that a plan of a motion may take."
    )

    def __post_init__(self) -> None:
        for item in fields(self):
            limits = item.metadata
            value = checks.real(
                item.name,
                getattr(self, item.name),
                low=limits["low"],
                high=limits["high"],
                unit=limits["unit"],
            )
            object.__setattr__(self, item.name, value)
        checks.real("default_force", self.default_force, high=self.max_force, unit="N")
