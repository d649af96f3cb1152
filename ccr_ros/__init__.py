# SPDX-License-Identifier: Apache-2.0
"""Grippers with cable-driven continuum fingers: model, solver and ROS 2 nodes."""

__version__ = "0.1.0"
