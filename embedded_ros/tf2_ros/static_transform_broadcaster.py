# SPDX-License-Identifier: Apache-2.0
"""Sends transforms that stay."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from geometry_msgs.msg import TransformStamped
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile
from tf2_msgs.msg import TFMessage


class StaticTransformBroadcaster:
    """Publishes transforms on /tf_static, where late joiners get them too."""

    def __init__(self, node: Any, qos: QoSProfile | int | None = None) -> None:
        """Make a broadcaster of a node; default QoS: reliable, transient local, depth 1."""
        if qos is None:
            qos = QoSProfile(
                depth=1,
                durability=DurabilityPolicy.TRANSIENT_LOCAL,
                history=HistoryPolicy.KEEP_LAST,
            )
        self.net_message = TFMessage()
        self.pub_tf = node.create_publisher(TFMessage, "/tf_static", qos)

    def sendTransform(self, transform: TransformStamped | Iterable[TransformStamped]) -> None:
        """Send one transform or several; the last one of each child frame stays."""
        transforms: Any = list(transform) if hasattr(transform, "__iter__") else [transform]
        for new in transforms:
            for index, old in enumerate(self.net_message.transforms):
                if old.child_frame_id == new.child_frame_id:
                    self.net_message.transforms[index] = new
                    break
            else:
                self.net_message.transforms.append(new)
        self.pub_tf.publish(self.net_message)
