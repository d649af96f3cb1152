# SPDX-License-Identifier: Apache-2.0
"""The ROS 2 nodes: plain rclpy, one file each; messages in, calls on the model, messages out."""
