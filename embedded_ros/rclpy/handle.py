# SPDX-License-Identifier: Apache-2.0
"""Kept for code that imports InvalidHandle from here."""

from .exceptions import InvalidHandle

__all__ = ["InvalidHandle"]
