# SPDX-License-Identifier: Apache-2.0
"""The colours that plots, strips and replays share; each reads on white and on near-black."""

from __future__ import annotations

# One per finger, or per cable of a single finger.
PALETTE = ("#2f7de1", "#12a06e", "#d98a00", "#8b5cf6", "#0aa5c2", "#d6569f", "#7a9e1f", "#a8714a")
CONTACT = "#d92d3a"
FRICTION = "#8247d8"
OBJECT = "#0aa5c2"
REST = "#9aa3af"
WANTED = "#e255b5"
BACKBONE = "#2b3442"
DISK = "#8d99aa"
OBSTACLE = "#8fa0b8"
SLACK = "#8a94a3"


def color(index: int) -> str:
    """Return the colour of the index-th finger or cable; the palette repeats."""
    return PALETTE[index % len(PALETTE)]
