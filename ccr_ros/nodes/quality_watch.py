# SPDX-License-Identifier: Apache-2.0
"""The quality of a grasp as a message, measured now and then: it takes longer than the grasp."""

from __future__ import annotations

import math
from contextlib import suppress

import numpy as np
from ccr_msgs.msg import GraspQuality
from rclpy.impl.rcutils_logger import RcutilsLogger

from ccr_ros.grasp.quality import quality_of
from ccr_ros.grasp.statics import GraspSolution
from ccr_ros.grasp.statics.body import GRAVITY


class QualityWatch:
    """Keeps the quality of the last solution that was measured.

    Args:
        gravity: (3,) in the gripper's frame: where the payload pulls.
        log: Told where a quality cannot be found.
    """

    def __init__(self, gravity: np.ndarray, log: RcutilsLogger) -> None:
        self._weighs = bool(np.any(gravity))
        self._gravity = gravity if self._weighs else GRAVITY
        self._log = log
        self._of: GraspSolution | None = None
        self._message = unknown_quality()
        # It takes most of a second to load: better now than at the first grasp.
        with suppress(ImportError):
            import scipy.optimize
            import scipy.spatial  # noqa: F401

    def forget(self) -> None:
        """Forget what was measured: the object is another one."""
        self._of, self._message = None, unknown_quality()

    def measure(self, solution: GraspSolution) -> None:
        """Find out the quality of a solution; not known where it cannot be."""
        if solution is self._of:
            return
        self._of, self._message = solution, unknown_quality()
        if not solution.contacts:
            return
        try:
            found = quality_of(solution, gravity=self._gravity)
        except Exception as error:  # whatever it is, the grasp itself must go on
            self._log.warning(f"quality not known: {error}", throttle_duration_sec=60.0)
            return
        self._message = GraspQuality(
            margin=float(found.margin),
            force_closure=bool(found.force_closure),
            epsilon=float(found.epsilon),
            weakest=found.weakest_in_words,
            payload=float(found.payload) if self._weighs else math.nan,
        )

    def message(self, solution: GraspSolution) -> GraspQuality:
        """Return the quality as last measured, with the margin of this solution."""
        last = self._message
        return GraspQuality(
            margin=float(solution.margin),
            force_closure=last.force_closure,
            epsilon=last.epsilon,
            weakest=last.weakest,
            payload=last.payload,
        )


def unknown_quality() -> GraspQuality:
    """Return a quality of which nothing is known."""
    return GraspQuality(margin=math.nan, epsilon=math.nan, payload=math.nan)
