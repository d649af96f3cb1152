# SPDX-License-Identifier: Apache-2.0
"""The broadcasting half of tf2_ros."""

from .static_transform_broadcaster import StaticTransformBroadcaster
from .transform_broadcaster import TransformBroadcaster

__all__ = ["StaticTransformBroadcaster", "TransformBroadcaster"]
