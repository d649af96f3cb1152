# SPDX-License-Identifier: Apache-2.0
"""Made-up poses for drawing tests: constant-curvature fingers that close on a ball and open again.

Nothing here is physics: the drawings only need poses of the right shape.
"""

from __future__ import annotations

import math

import numpy as np

from ccr_ros.model import Cable, Certificate, Contact, Finger, Pose, Solution, Sphere
from ccr_ros.viz.recording import RecordedFinger, Recording, SolidObject
from ccr_ros.viz.recording_builder import RecordingBuilder

LENGTH, RADIUS, SEGMENTS = 0.182, 0.008, 9
SPOOL = 0.01  # m, radius
PHASES = (
    (0.08, "ready"),
    (0.42, "closing"),
    (0.62, "holding"),
    (0.94, "releasing"),
    (1.0, "open"),
)
BALL = Sphere(np.array([0.0, 0.0, 0.110]), 0.056, name="ball")


def finger(name: str = "finger", **changes: object) -> Finger:
    """A finger with an inner cable (towards +x) and an outer one (towards -x)."""
    values: dict[str, object] = {
        "name": name,
        "length": LENGTH,
        "segments": SEGMENTS,
        "disk_radius": RADIUS,
        "backbone_diameter": 0.0025,
        "poisson_ratio": 0.39,
        "youngs_modulus": 2.8e9,
        "cables": (Cable.from_holes("inner", [1] * 10), Cable.from_holes("outer", [7] * 10)),
    }
    return Finger(**{**values, **changes})  # type: ignore[arg-type]


def arcs(angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Disk positions and frames in the x-z plane, whose angles from z are given; circular arcs."""
    half = np.diff(angles) / 2
    chord = LENGTH / SEGMENTS * np.sinc(half / math.pi)
    middle = angles[:-1] + half
    steps = chord[:, None] * np.column_stack([np.sin(middle), 0 * middle, np.cos(middle)])
    frames = np.zeros((len(angles), 3, 3))
    frames[:, 0, 0] = frames[:, 2, 2] = np.cos(angles)
    frames[:, 0, 2], frames[:, 2, 0], frames[:, 1, 1] = np.sin(angles), -np.sin(angles), 1
    return np.vstack([np.zeros(3), np.cumsum(steps, axis=0)]), frames


def solution(
    closing: float = 0.5,
    *,
    of: Finger | None = None,
    contacts: tuple[Contact, ...] = (),
    converged: bool = True,
    outward: float = 0.5,
) -> Solution:
    """A pose between open (0) and closed (1); leaning outward, then curling in."""
    of = of or finger()
    s = np.linspace(0, 1, SEGMENTS + 1)
    angles = -outward * np.sin(math.pi * s) + closing * 1.2 * s**2
    backbone, frames = arcs(angles)
    curvature = np.zeros((SEGMENTS, 1, 1, 3))
    curvature[:, 0, 0, 1] = np.diff(angles) * SEGMENTS / LENGTH
    cables = {
        c.name: backbone
        + RADIUS
        * (
            np.cos(c.angles)[:, None] * frames[:, :, 0]
            + np.sin(c.angles)[:, None] * frames[:, :, 1]
        )
        for c in of.cables
    }
    tensions = np.array([8.0 * closing, 0.0])[: len(of.cables)]
    certificate = Certificate(
        converged,
        True,
        1e-12,
        1e-13,
        0.0,
        0.8,
        5,
        1e-3,
        message="" if converged else "iteration limit",
    )
    return Solution(
        finger=of,
        pulls=np.array([0.0055 * closing, -0.002 * closing])[: len(of.cables)],
        backbone=backbone,
        frames=frames,
        cables=cables,
        antagonists={name: 2 * backbone - points for name, points in cables.items()},
        tensions=tensions,
        contacts=contacts,
        energy=0.01 * closing,
        curvature=curvature,
        certificate=certificate,
    )


def touching(pose: Solution, ball: Sphere, reach: float, force: float) -> tuple[Contact, ...]:
    """Contacts of the inner cable's points that are within ``reach`` of the ball."""
    points = pose.cables["inner"]
    distance = ball.signed_distance(points)
    normals, _ = ball.derivatives(points)
    return tuple(
        Contact(i, "cable", "inner", ball.name, points[i], normals[i], force * (1 + 0.2 * i))
        for i in range(1, len(points))
        if distance[i] < reach
    )


def bases(count: int = 3, offset: float = 0.042) -> list[Pose]:
    """Bases around the gripper's axis, each with its x axis towards it."""
    out = []
    for k in range(count):
        a = 2 * math.pi * k / count
        turn = a + math.pi
        out.append(
            Pose(
                np.array([offset * math.cos(a), offset * math.sin(a), 0.0]),
                np.array([0.0, 0.0, math.sin(turn / 2), math.cos(turn / 2)]),
            )
        )
    return out


def closing_at(t: float, duration: float) -> float:
    """0 open, 1 closed: rest, close, hold, open."""
    share = t / duration
    rise = np.interp(share, [0, 0.08, 0.42, 0.62, 0.94, 1], [0, 0, 1, 1, 0, 0])
    return float(rise * rise * (3 - 2 * rise))


def recording(
    duration: float = 10.0, rate: float = 25.0, name: str = "sphere gripper", count: int = 3
) -> Recording:
    """Three fingers close on a ball and open again; the third later, and stale for a while."""
    fingers = [finger(f"finger_{k + 1}") for k in range(count)]
    places = bases(count)
    builder = RecordingBuilder(
        name,
        [
            RecordedFinger(f.name, b, RADIUS, f.cable_names, rest_lengths=(LENGTH, LENGTH))
            for f, b in zip(fingers, places, strict=True)
        ],
        objects=[SolidObject.from_obstacle(BALL)],
    )
    for i in range(int(duration * rate) + 1):
        t = i / rate
        for k, (f, base) in enumerate(zip(fingers, places, strict=True)):
            late = 0.35 * max(0, k - 1)
            pose = solution(closing_at(t - late, duration) * (1 - 0.06 * max(0, k - 1)), of=f)
            contacts = touching(
                pose, BALL.moved(base.inverse()), 0.0008, 0.6 * pose.tensions[0] / 8
            )
            pose = solution(
                closing_at(t - late, duration) * (1 - 0.06 * max(0, k - 1)), of=f, contacts=contacts
            )
            builder.add_solution(f.name, pose, stale=k == 2 and 0.70 < t / duration < 0.72)
            builder.add(f.name, servo_angles=pose.pulls / SPOOL)
        builder.set_phase(next(name for share, name in PHASES if t / duration <= share))
        builder.sample(100.0 + t)
    return builder.build()
