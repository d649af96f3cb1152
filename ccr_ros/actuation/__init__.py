# SPDX-License-Identifier: Apache-2.0
"""From cable pulls to servo angles and back: limits, safety, calibration, drivers. ROS-free."""
