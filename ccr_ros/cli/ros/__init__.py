# SPDX-License-Identifier: Apache-2.0
"""Commands that look at a ROS graph and drive it, in the words of the ``ros2`` command.

One module for each noun (topic, node, ...). They are plain rclpy, real or embedded, which they
import when a verb runs and not before: help and completion need no ROS.
"""
