# SPDX-License-Identifier: Apache-2.0
"""Interface packages from their texts: parsing, message classes, their CDR code."""
