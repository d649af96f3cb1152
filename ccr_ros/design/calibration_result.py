# SPDX-License-Identifier: Apache-2.0
"""What a calibration gives: estimates with their intervals, and what could not be found."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Estimate:
    """A fitted parameter.

    Attributes:
        name: ``EI`` [N m^2], ``nu``, or ``stretch`` [m/N].
        value: The estimate.
        low, high: 95 % confidence interval; equal to the value where there are no more data than
            parameters.
        at_bound: The fit ended at the end of the allowed range: the model does not explain the
            data with this parameter, and the interval means nothing.
    """

    name: str
    value: float
    low: float
    high: float
    at_bound: bool = False


@dataclass(frozen=True, eq=False)
class Calibration:
    """What measurements say about a finger.

    Attributes:
        estimates: The parameters that were found, by name.
        unknown: Why, by name, for those that the data do not determine; they were held.
        position_scatter: Standard deviation of the measured coordinates about the model [m]; NaN
            without positions.
        load_scatter: Of the measured loads [N]; NaN without loads.
        residuals: (r,) of all measurements, in units of their standard deviations.
        stiffness: (k, 2) of each measured load, in the order of the rows: index of the row, and
            the EI [N m^2] that explains this load alone.
        products: EI times stretch [N m^2 * m/N = m^3], by stretch parameter, where the product is
            known but EI is not.
    """

    estimates: dict[str, Estimate]
    unknown: dict[str, str]
    position_scatter: float
    load_scatter: float
    residuals: np.ndarray
    stiffness: np.ndarray
    products: dict[str, float]


_STUDENT = (12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228)


def student(freedom: int) -> float:
    """Return the 97.5 % quantile of Student's t; beyond 10 degrees by Cornish and Fisher."""
    if freedom <= len(_STUDENT):
        return _STUDENT[freedom - 1]
    z, n = 1.959964, freedom
    first, second = (z**3 + z) / 4, (5 * z**5 + 16 * z**3 + 3 * z) / 96
    third = (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / 384
    return z + first / n + second / n**2 + third / n**3
