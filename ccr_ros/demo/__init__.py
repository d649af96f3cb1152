# SPDX-License-Identifier: Apache-2.0
"""The pieces of ``ccr demo``: a script of pulls, a node that publishes it, one that records."""
