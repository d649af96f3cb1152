# SPDX-License-Identifier: Apache-2.0
"""One thread for NumPy's linear algebra, which must be said before NumPy is loaded."""

from __future__ import annotations

import os

_VARIABLES = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def use_one_thread() -> None:
    """Have BLAS use one thread, unless the environment says otherwise; call before `import numpy`.

    A finger's matrices are small: threads have little to share, and spin while they wait for each
    other. Programs of this package call this at their start; as a library it leaves that to you.
    """
    for name in _VARIABLES:
        os.environ.setdefault(name, "1")
