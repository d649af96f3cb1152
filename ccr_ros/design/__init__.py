# SPDX-License-Identifier: Apache-2.0
"""Inverse problems on the finger model, free of ROS: rest shape, routing, pulls, calibration."""
