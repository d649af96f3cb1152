# SPDX-License-Identifier: Apache-2.0
"""Peak resident memory of one solver, measured in a process of its own.

``python -m benchmarks.memory METHOD CASE N`` prints megabytes above the imported libraries.
"""

from __future__ import annotations

import resource
import subprocess
import sys
from pathlib import Path

import numpy as np

from .cases import load_case
from .grasping import ball_maker, ball_path
from .suites import OWN, cartesian, own

STEPS = 5

_STATUS = Path("/proc/self/status")


def memory_megabytes(peak: bool) -> float:
    """Return the resident memory of this process [MB], now or (``peak``) at its highest.

    Where there is no /proc it is the highest so far in both cases.
    """
    if _STATUS.exists():
        # Not ru_maxrss: on Linux it starts at the parent's, through fork and exec.
        key = "VmHWM:" if peak else "VmRSS:"
        lines = _STATUS.read_text(encoding="ascii").splitlines()
        return next(float(line.split()[1]) for line in lines if line.startswith(key)) * 1024 / 1e6
    highest = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return highest / (1e6 if sys.platform == "darwin" else 1e6 / 1024)  # bytes there, else KiB


def measure_memory(method: str, case: str, n: int) -> float:
    """Return the memory [MB] that a solver's build and steps take, in a fresh interpreter.

    Raises:
        subprocess.CalledProcessError: The solver failed; its output is on standard error.
    """
    command = [sys.executable, "-m", "benchmarks.memory", method, case, str(n)]
    return float(subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout)


def main(method: str, name: str, n: int) -> None:
    """Measure in this process and print the megabytes."""
    if name == "ball":
        path, make = ball_path(STEPS), ball_maker(method)
        before = memory_megabytes(peak=False)
        solve = make()
        for pulls in path:
            solve(pulls)
        print(memory_megabytes(peak=True) - before)
        return
    case = load_case(name, n)
    before = memory_megabytes(peak=False)
    sweeper = own(case)() if method == OWN else cartesian(case, method)()
    for k in range(1, STEPS + 1):
        sweeper.step(float(case.pull_fraction[0]) * k / 20, np.inf)
    print(memory_megabytes(peak=True) - before)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]))
