# SPDX-License-Identifier: Apache-2.0
"""Publishers of lifecycle nodes."""

from __future__ import annotations

from typing import Any

from ..publisher import Publisher
from .managed_entity import SimpleManagedEntity


class LifecyclePublisher(SimpleManagedEntity, Publisher):
    """A publisher that drops what is published while its node is not active. Made by
    :meth:`rclpy.lifecycle.LifecycleNode.create_lifecycle_publisher`.
    """

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        SimpleManagedEntity.__init__(self)
        Publisher.__init__(self, *args, **kwargs)

    @SimpleManagedEntity.when_enabled
    def publish(self, msg: Any) -> None:
        """Send a message, or the bytes of an encoded one, if the node is active."""
        Publisher.publish(self, msg)
