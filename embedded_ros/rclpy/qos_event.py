# SPDX-License-Identifier: Apache-2.0
"""The former place of :mod:`rclpy.event_handler`."""

from .event_handler import EventHandler, PublisherEventCallbacks, SubscriptionEventCallbacks

QoSEventHandler = EventHandler

__all__ = ["PublisherEventCallbacks", "QoSEventHandler", "SubscriptionEventCallbacks"]
