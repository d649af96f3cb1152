# SPDX-License-Identifier: Apache-2.0
"""Names of the tf frames, so that grippers side by side do not collide in the one tf tree."""

from __future__ import annotations

from dataclasses import dataclass


def prefix_of(namespace: str) -> str:
    """Return the frame prefix of a node's namespace: ``/left/gripper`` -> ``left/gripper/``."""
    inner = namespace.strip("/")
    return f"{inner}/" if inner else ""


@dataclass(frozen=True)
class FingerFrames:
    """Frames of one finger: the gripper's, that of its base disk and that of its tip disk."""

    gripper: str
    base: str
    tip: str

    @classmethod
    def of(cls, finger: str, gripper: str, prefix: str) -> FingerFrames:
        """Name the frames of a finger."""
        return cls(gripper, f"{prefix}{finger}_base", f"{prefix}{finger}_tip")
