# SPDX-License-Identifier: Apache-2.0
"""Where rclpy keeps its compiled module; here it holds the error classes only."""

from .. import _rclpy_pybind11 as rclpy_implementation

__all__ = ["rclpy_implementation"]
