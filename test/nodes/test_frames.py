# SPDX-License-Identifier: Apache-2.0
"""Names of frames."""

import pytest

from ccr_ros.nodes.frames import FingerFrames, prefix_of


@pytest.mark.parametrize(
    ("namespace", "prefix"), [("/", ""), ("/gripper", "gripper/"), ("/left/hand", "left/hand/")]
)
def test_frames_come_from_the_namespace(namespace, prefix):
    assert prefix_of(namespace) == prefix
    frames = FingerFrames.of("thumb", "world", prefix_of(namespace))
    assert frames == FingerFrames("world", f"{prefix}thumb_base", f"{prefix}thumb_tip")
