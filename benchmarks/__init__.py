# SPDX-License-Identifier: Apache-2.0
"""What ``ccr bench`` runs: the finger model beside the literature's formulation, in one run."""
