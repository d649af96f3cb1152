# SPDX-License-Identifier: Apache-2.0
"""The ``ccr`` command line: one module per command."""
