# SPDX-License-Identifier: Apache-2.0
"""The part of rosidl_parser that says what the members of a message are."""
