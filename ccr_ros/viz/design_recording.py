# SPDX-License-Identifier: Apache-2.0
"""A designed gripper closing on its object, as a recording: for replays and strips."""

from __future__ import annotations

from itertools import zip_longest

from ..design.gripper import GripperDesign
from .recording import Recording, SolidObject
from .recording_builder import RecordingBuilder

_STEP = 0.3  # s from one step of the pull to the next


def recording_of_design(design: GripperDesign) -> Recording:
    """Return the proof of a design, all fingers pulled together from rest, as a recording."""
    layout = design.task.layout
    body = SolidObject.from_obstacle(layout.obstacle(), extent=layout.body.extent[2])
    names = design.gripper.finger_names
    rest_lengths = {n: d.rest.rest_lengths for n, d in zip(names, design.fingers, strict=True)}
    builder = RecordingBuilder.of_gripper(design.gripper, objects=[body], rest_lengths=rest_lengths)
    for k, poses in enumerate(zip_longest(*(d.path.steps for d in design.fingers))):
        for name, pose in zip(names, poses, strict=True):
            if pose is not None:
                builder.add_solution(name, pose)
        builder.sample(k * _STEP)
    return builder.build()
