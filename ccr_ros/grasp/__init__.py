# SPDX-License-Identifier: Apache-2.0
"""Several fingers and one object: the gripper's states, closing, holding, letting go. No ROS."""
