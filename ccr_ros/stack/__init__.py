# SPDX-License-Identifier: Apache-2.0
"""Several nodes started together, watched and ended: as processes, or as threads of this one."""
