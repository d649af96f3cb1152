# SPDX-License-Identifier: Apache-2.0
"""Pictures of fingers and grippers: markers, plots, strips and a replay for the browser."""
