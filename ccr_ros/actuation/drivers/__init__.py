# SPDX-License-Identifier: Apache-2.0
"""The kinds of servo racks: simulated, behind ros2_control, on a Dynamixel bus."""
