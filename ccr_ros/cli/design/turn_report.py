# SPDX-License-Identifier: Apache-2.0
"""What `ccr design turn` found, for people and for programs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ccr_ros.design.turn import TurnResult, TurnTask, TurnWay
from ccr_ros.design.turn_search import TurnSearch
from ccr_ros.grasp.quality import SlipLoads
from ccr_ros.model import Gripper


def report(
    gripper: Gripper, task: TurnTask, result: TurnResult, angle: float, loads: SlipLoads | None
) -> str:
    """Return what a gripper does as lines for people."""
    body = task.body
    lines = [
        f"{gripper.name}: {len(gripper.fingers)} fingers; {body.name}, {body.mass * 1e3:g} g,"
        f" friction {body.friction:g}",
        f"  closed with {_forces(task, gripper)}",
    ]
    if result.hold is not None:
        lines += _hold(result)
    if loads is not None:
        lost = "" if math.isinf(loads.lost_at) else f", lost at {loads.lost_at:.3g} N"
        lines.append(f"  weight {loads.present:.3g} N; held up to {loads.held:.3g} N{lost}")
    if not result.held:
        return "\n".join([*lines, f"  NOT HELD: {result.failure}"])
    lines += [
        "",
        f"  {'':<6}{'turn':>9}{'margin':>9}{'shift x':>10}{'y':>8}{'z mm':>8}{'tilt x':>9}"
        f"{'y deg':>8}  what ends it",
    ]
    lines += [_way(way) for way in result.ways]
    wanted = math.degrees(angle)
    if result.reached(angle):
        lines.append(f"  turns by {wanted:g} deg both ways")
    else:
        lines.append(f"  DOES NOT TURN by {wanted:g} deg both ways")
    return "\n".join(lines)


def summary(task: TurnTask, result: TurnResult) -> str:
    """Return one line of what a gripper does."""
    if not result.held:
        return f"Does not hold the object: {result.failure}"
    turns = ", ".join(f"{math.degrees(way.plan.moved[5]):+.1f}" for way in result.ways)
    forces = _forces(task)
    return f"Turns a {task.body.name} by {turns} deg about z, closed with {forces}."


def to_dict(
    gripper: Gripper, task: TurnTask, result: TurnResult, angle: float, loads: SlipLoads | None
) -> dict[str, Any]:
    """Return what a gripper does as what JSON can hold; null where a number is not known."""
    found: dict[str, Any] = {
        "gripper": gripper.name,
        "held": result.held,
        "reached": result.reached(angle),
        "wanted_deg": math.degrees(angle),
        "failure": result.failure,
        "object": {
            "name": task.body.name,
            "mass": task.body.mass,
            "friction": task.body.friction,
        },
        "forces": dict(_by_finger(task, gripper)),
        "hold": None,
        "ways": [
            {
                "turn_deg": math.degrees(way.plan.moved[5]),
                "margin": _number(way.plan.margin),
                "shift": way.plan.moved[:3].tolist(),
                "tilt_deg": np.rad2deg(way.plan.moved[3:5]).tolist(),
                "limiting": way.limiting,
                "pulls": [
                    {name: pulls.tolist() for name, pulls in waypoint.pulls.items()}
                    for waypoint in way.plan.waypoints
                ],
                "turns_deg": [math.degrees(w.moved[5]) for w in way.plan.waypoints],
                "margins": [_number(w.margin) for w in way.plan.waypoints],
            }
            for way in result.ways
        ],
    }
    if result.hold is not None:
        found["hold"] = {
            "margin": _number(result.hold.margin),
            "smallest_eigenvalue": result.hold.smallest_eigenvalue,
            "softest": result.hold.softest,
            "contacts": [
                {
                    "finger": c.finger,
                    "disk": c.disk,
                    "position": c.position.tolist(),
                    "force": c.force,
                    "margin": _number(c.margin),
                }
                for c in result.hold.contacts
            ],
        }
    if loads is not None:
        found["loads"] = {
            "present": loads.present,
            "held": loads.held,
            "lost_at": _number(loads.lost_at),
        }
    return found


def search_to_dict(search: TurnSearch) -> dict[str, Any]:
    """Return how a search went as what JSON can hold."""
    return {
        "tried": search.tried,
        "stopped": search.stopped,
        "given_score": search.given.score,
        "best_score": search.best.score,
        "force_factor": search.best.choice.force,
    }


def _hold(result: TurnResult) -> list[str]:
    hold = result.hold
    assert hold is not None
    lines = []
    for name, pulls in result.solver.pulls.items():
        finger = next(f.finger for f in hold.fingers if f.finger.name == name)
        own = [c for c in hold.contacts if c.finger == name]
        cables = ", ".join(
            f"{cable} {pull * 1e3:.3f} mm"
            for cable, pull in zip(finger.cable_names, pulls, strict=True)
        )
        touches = "; ".join(
            f"disk {c.disk} at y {c.position[1] * 1e3:.2f} z {c.position[2] * 1e3:.2f} mm"
            f" presses {c.force:.4g} N, margin {c.margin:.2f}"
            for c in own
        )
        lines.append(f"  {name:<10} {cables}; {touches or 'does not touch'}")
    lines.append(
        f"  held with margin {hold.margin:.2f}; smallest eigenvalue {hold.smallest_eigenvalue:.3g}"
        f" ({hold.softest})"
    )
    return lines


def _way(way: TurnWay) -> str:
    moved = way.plan.moved
    x, y, z = (1e3 * moved[:3]).round(2) + 0.0
    tilts = np.rad2deg(moved[3:5]).round(1) + 0.0
    word = "left" if way.plan.target.turn[2] > 0 else "right"
    return (
        f"  {word:<6}{math.degrees(moved[5]):>+9.1f}{way.plan.margin:>9.2f}{x:>10.2f}{y:>8.2f}"
        f"{z:>8.2f}{tilts[0]:>9.1f}{tilts[1]:>8.1f}  {way.limiting or 'no further asked for'}"
    )


def _by_finger(task: TurnTask, gripper: Gripper) -> Mapping[str, float]:
    if isinstance(task.forces, Mapping):
        return task.forces
    return dict.fromkeys(gripper.finger_names, task.forces)


def _forces(task: TurnTask, gripper: Gripper | None = None) -> str:
    if not isinstance(task.forces, Mapping) and gripper is None:
        return f"{task.forces:.3g} N"
    forces = task.forces if gripper is None else _by_finger(task, gripper)
    assert isinstance(forces, Mapping)
    return ", ".join(f"{name} {force:.3g} N" for name, force in forces.items())


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
