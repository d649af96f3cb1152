# SPDX-License-Identifier: Apache-2.0
"""One moment of a recording drawn in plain 2-D axes: parallel projection, painted from far to near.

Unlike matplotlib's own 3-D axes this hides what is behind, to the segment of a finger.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from ..model.rotation import matrix_from_quaternion
from . import palette
from .figures import MM
from .recording import FingerFrame, Frame, RecordedFinger, Recording, SolidObject
from .shapes import circle, hull, smooth, surface

ELEVATION, AZIMUTH = 18.0, 35.0  # degrees

_ARROW = {
    "arrowstyle": "-|>,head_width=0.22,head_length=0.4",
    "color": palette.CONTACT,
    "lw": 1.5,
    "shrinkA": 0,
    "shrinkB": 0,
}


class View:
    """A parallel projection along a direction given by its angles [degree]."""

    def __init__(self, elevation: float = ELEVATION, azimuth: float = AZIMUTH) -> None:
        e, a = np.radians([elevation, azimuth])
        self.towards_viewer = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        self.right = np.array([-np.sin(a), np.cos(a), 0.0])
        self.up = np.cross(self.towards_viewer, self.right)
        self.light = 0.6 * self.towards_viewer + 0.65 * self.up - 0.45 * self.right
        self.light /= np.linalg.norm(self.light)

    def flat(self, points: np.ndarray) -> np.ndarray:
        """Project points (p, 3) [m] to the picture (p, 2) [mm]."""
        return points @ np.column_stack([self.right, self.up]) * MM

    def nearness(self, points: np.ndarray) -> float:
        """Mean distance towards the viewer [mm], which serves as the drawing order."""
        return float(np.mean(points @ self.towards_viewer)) * MM


def draw_moment(axes: Any, recording: Recording, frame: Frame, view: View) -> None:
    """Draw the gripper and the objects of a frame; sets no limits."""
    for body in recording.objects_at(frame):
        _draw_body(axes, body, view)
    strongest = max(
        (c.force for f in recording.frames for g in f.fingers.values() for c in g.contacts),
        default=0.0,
    )
    for k, finger in enumerate(recording.fingers):
        if finger.name in frame.fingers:
            colors = [cable_color(k, j, len(recording.fingers)) for j in range(len(finger.cables))]
            _draw_finger(axes, finger, frame.fingers[finger.name], colors, strongest, view)


def cable_color(finger: int, cable: int, fingers: int) -> str:
    """One hue per finger, or per cable of a single finger."""
    return palette.color(finger if fingers > 1 else cable)


def bounds(recording: Recording, view: View) -> tuple[np.ndarray, np.ndarray]:
    """Return the lower left and upper right corner [mm] of all that any frame shows."""
    parts = [surface(o).vertices for f in recording.frames[:1] for o in recording.objects_at(f)]
    for frame in recording.frames:
        for name, f in frame.fingers.items():
            finger = recording.finger(name)
            parts += [finger.base.points(f.backbone) + finger.disk_radius * d for d in np.eye(3)]
            parts += [finger.base.points(f.backbone) - finger.disk_radius * d for d in np.eye(3)]
    flat = view.flat(np.vstack(parts or [np.zeros((1, 3))]))
    return flat.min(axis=0), flat.max(axis=0)


def _draw_finger(
    axes: Any,
    finger: RecordedFinger,
    now: FingerFrame,
    colors: list[str],
    strongest: float,
    view: View,
) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Polygon

    base, alpha = finger.base, 0.45 if now.stale or not now.converged else 1.0
    backbone = base.points(now.backbone)

    def line(points: np.ndarray, nearer: float = 0.0, **style: Any) -> None:
        order = view.nearness(points) + nearer
        # axes.plot would look at all limits anew, for each of some hundred pieces.
        axes.add_artist(Line2D(*view.flat(points).T, zorder=order, alpha=alpha, **style))

    for center, turn in zip(backbone, now.orientations, strict=True):
        r = base.rotation @ matrix_from_quaternion(turn)
        rim = view.flat(circle(center, r[:, 0], r[:, 1], finger.disk_radius))
        light = 0.80 + 0.20 * abs(float(r[:, 2] @ view.light))
        face = _mixed("#ffffff", colors[0], 0.25, light)
        style = {"facecolor": face, "edgecolor": palette.DISK, "linewidth": 0.7, "alpha": alpha}
        axes.add_artist(Polygon(rim, closed=True, zorder=view.nearness(center[None]), **style))
    tangents = np.array([base.rotation @ matrix_from_quaternion(q)[:, 2] for q in now.orientations])
    curve = smooth(backbone, tangents, 3)
    for a, b in pairwise(curve):
        line(np.array([a, b]), color=palette.BACKBONE, lw=2.0, solid_capstyle="round")
    for j, name in enumerate(finger.cables):
        if name in now.cables:
            points = base.points(now.cables[name])
            taut = now.tensions[j] > 0
            look: dict[str, Any] = {"color": colors[j], "lw": 1.8, "solid_capstyle": "round"}
            if not taut:
                look = {"color": palette.SLACK, "lw": 0.9, "ls": (0, (2.5, 1.5))}
            for a, b in pairwise(points):
                line(np.array([a, b]), nearer=0.5, **look)
    for contact in now.contacts:
        size = 0.012 + (0.024 * contact.force / strongest if strongest else 0.0)
        ends = base.points(np.array([contact.position, contact.position + size * contact.normal]))
        foot, head = view.flat(ends)
        order = view.nearness(ends[1:]) + 4.0
        axes.annotate(
            "", xy=head, xytext=foot, zorder=order,
            arrowprops={**_ARROW, "zorder": order},
        )  # fmt: skip
        axes.plot(
            *foot, marker="o", ms=4, color=palette.CONTACT, mec="white", mew=0.6, zorder=order
        )


def _draw_body(axes: Any, body: SolidObject, view: View) -> None:
    from matplotlib.collections import PolyCollection
    from matplotlib.patches import Polygon

    skin = surface(body)
    # A mesh's frame may be anywhere; its corners are around it, as are the others'.
    center = skin.vertices.mean(axis=0) if body.kind == "mesh" else body.pose.position
    order = view.nearness(center[None])
    if body.kind == "sphere":
        _shade_ball(axes, view.flat(center[None])[0], body.dimensions[0] * MM, view, order)
    else:
        shapes, colors = [], []
        for face in skin.faces:
            normal = np.cross(face[2] - face[0], face[1] - face[-1])
            normal = normal / (np.linalg.norm(normal) or 1.0)
            normal = normal if normal @ (face.mean(axis=0) - center) > 0 else -normal
            if normal @ view.towards_viewer > 0:
                shapes.append(view.flat(face))
                light = 0.72 + 0.34 * float(normal @ view.light)
                colors.append(_mixed(palette.OBSTACLE, "#ffffff", 0.35, light))
        axes.add_collection(
            PolyCollection(
                shapes, facecolors=colors, edgecolors="face", linewidths=0.3, zorder=order
            )
        )
    outline = hull(view.flat(skin.vertices))
    axes.add_patch(
        Polygon(outline, closed=True, fill=False, edgecolor="#6c7a90", lw=1.0, zorder=order)
    )


def _shade_ball(axes: Any, middle: np.ndarray, radius: float, view: View, order: float) -> None:
    """Draw a slightly transparent ball as a picture of its shading."""
    x, y = np.meshgrid(*2 * [np.linspace(-1, 1, 161)])
    depth = np.sqrt(np.clip(1 - x**2 - y**2, 0, 1))
    light = np.array([view.light @ v for v in (view.right, view.up, view.towards_viewer)])
    shade = 0.70 + 0.40 * np.clip(light[0] * x + light[1] * y + light[2] * depth, 0, 1)
    picture = np.empty((*x.shape, 4))
    picture[..., :3] = np.clip(
        np.array(_mixed(palette.OBSTACLE, "#ffffff", 0.4, 1.0)) * shade[..., None], 0, 1
    )
    picture[..., 3] = np.where(x**2 + y**2 <= 1, 0.86, 0.0)
    (left, low), (right, high) = middle - radius, middle + radius
    axes.imshow(
        picture,
        extent=(left, right, low, high),
        origin="lower",
        zorder=order,
        interpolation="bilinear",
    )


def draw_plate(axes: Any, recording: Recording, view: View) -> None:
    """Draw a round base plate that carries all finger bases."""
    from matplotlib.patches import Polygon

    positions = np.array([f.base.position for f in recording.fingers])
    center = positions.mean(axis=0)
    center[2] = positions[:, 2].min()
    reach = np.linalg.norm((positions - center)[:, :2], axis=1)
    radius = max(r + 2.2 * f.disk_radius for r, f in zip(reach, recording.fingers, strict=True))
    top = circle(center, np.eye(3)[0], np.eye(3)[1], radius)
    low = top - np.array([0.0, 0.0, 0.005])
    far = -1e6
    rim = hull(view.flat(np.vstack([top, low])))
    axes.add_patch(Polygon(rim, closed=True, facecolor="#b3bccb", edgecolor="none", zorder=far))
    axes.add_patch(
        Polygon(
            view.flat(top), closed=True, facecolor="#d9dfe8", edgecolor="#c3ccd9", zorder=far + 1
        )
    )


def _mixed(a: str, b: str, share: float, light: float) -> tuple[float, float, float]:
    one, other = (np.array([int(c[i : i + 2], 16) / 255 for i in (1, 3, 5)]) for c in (a, b))
    r, g, blue = np.clip((one + (other - one) * share) * light, 0, 1)
    return float(r), float(g), float(blue)
