# SPDX-License-Identifier: Apache-2.0
"""A designed gripper as files: one gripper file, and one finger file for each kind of finger."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import yaml

from ..model.errors import InvalidFile
from ..model.files import Gripper
from ..model.finger_text import write_finger


def write_gripper(
    gripper: Gripper,
    kinds: list[int],
    folder: Path,
    finger_name: str,
    comment: str = "",
    finger_comments: list[str] | None = None,
) -> list[Path]:
    """Write NAME.yaml, NAME being the gripper's, and its fingers' files; return the paths.

    Args:
        gripper: The gripper.
        kinds: For each finger the number of its kind, 0, 1, ...; those of one kind share a file.
        folder: Where the files go; it must exist.
        finger_name: Of the finger file; where there are several kinds, _1, _2, ... follow.
        comment: Put at the head of the gripper file.
        finger_comments: One for each kind, put at the head of its file.

    Raises:
        InvalidFile: A file cannot be written.
    """
    several = max(kinds) > 0
    names = [f"{finger_name}_{k + 1}" if several else finger_name for k in range(max(kinds) + 1)]
    paths = []
    for k, name in enumerate(names):
        finger = gripper.fingers[kinds.index(k)].finger
        text = finger_comments[k] if finger_comments else ""
        paths.append(write_finger(replace(finger, name=name), folder / f"{name}.yaml", text))
    entries = [
        {
            "name": mounted.finger.name,
            "base": {
                "position": mounted.base.position.tolist(),
                "orientation": [round(v, 12) + 0.0 for v in mounted.base.orientation.tolist()],
            },
            "file": f"{names[kind]}.yaml",
        }
        for mounted, kind in zip(gripper.fingers, kinds, strict=True)
    ]
    head = "".join(f"# {line}".rstrip() + "\n" for line in comment.splitlines())
    body = yaml.safe_dump(
        {"name": gripper.name, "fingers": entries},
        sort_keys=False,
        default_flow_style=None,
        width=math.inf,
    )
    out = folder / f"{gripper.name}.yaml"
    try:
        out.write_text(head + body, encoding="utf-8")
    except OSError as error:
        raise InvalidFile(out, f"cannot be written: {error.strerror}") from None
    return [out, *paths]
