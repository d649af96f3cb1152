# SPDX-License-Identifier: Apache-2.0
"""Bending stiffness, Poisson's ratio and cable stretch of a finger from measurements.

Weighted least squares by Levenberg and Marquardt on the forward model, confidence intervals from
the Jacobian, and a plain word about every parameter that the measurements say nothing of.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ccr_ros.model import checks
from ccr_ros.model.errors import InvalidValue

from .calibration_model import Measurement, RowModel, Shown
from .calibration_result import Calibration, Estimate, student

#: What can be fitted; ``stretch`` is one for all cables, ``stretch_<cable>`` one cable's own.
PARAMETERS = ("EI", "nu", "stretch")

_BOUNDS = {"EI": (-30.0, 30.0), "nu": (-0.99, 0.5), "stretch": (0.0, math.inf)}
_WIDTHS = {"EI": 1.0, "nu": 0.5}  # what is believed beforehand: log EI to a factor e, nu to 0.5
_ROUNDS = 60
_STILL = 1e-8  # relative fall of the sum of squares, below which it is at its least
_WEIGHINGS = 4  # rounds of estimating what the measurements scatter by
_SMALLEST = {"position": 1e-6, "load": 1e-5}  # of the length, of the largest load
_UNKNOWN = 1.0  # widths; a parameter less certain than this is not known from the data


def calibrate(
    rows: Sequence[Measurement],
    fit: Sequence[str] = ("EI",),
    *,
    position_scatter: float | None = None,
    load_scatter: float | None = None,
    stiffness: float | None = None,
) -> Calibration:
    """Fit parameters to measurements.

    Args:
        rows: The measurements; of one finger, or of several of the same making.
        fit: What to fit: of ``EI``, ``nu``, ``stretch`` or ``stretch_<cable>``. What is not
            fitted is as the fingers say: their own nu, no stretch.
        position_scatter: Standard deviation of a measured coordinate [m]; ``None``: estimated.
        load_scatter: Of a measured load [N]; ``None``: estimated.
        stiffness: EI [N m^2], where it is known and not fitted.

    Raises:
        InvalidValue: No rows, or parameters that do not exist or contradict each other.
        NotConverged: A finger has no pose for the pulls of a row.
    """
    names = _checked_names(fit, rows)
    for place, value in (
        ("position_scatter", position_scatter),
        ("load_scatter", load_scatter),
        ("stiffness", stiffness),
    ):
        if value is not None:
            checks.real(place, value, above=0)
    return _Fit(rows, names, position_scatter, load_scatter, stiffness).run()


def _checked_names(fit: Sequence[str], rows: Sequence[Measurement]) -> tuple[str, ...]:
    if not rows:
        raise InvalidValue("rows", [], "at least one measurement")
    cables = {name for row in rows for name in row.finger.cable_names}
    allowed = [*PARAMETERS, *(f"stretch_{name}" for name in sorted(cables))]
    names = tuple(fit)
    for name in names:
        if name not in allowed or names.count(name) > 1:
            raise InvalidValue("fit", name, f"one of {', '.join(allowed)}, once")
    if not names:
        raise InvalidValue("fit", [], f"at least one of {', '.join(allowed)}")
    if "stretch" in names and any(name.startswith("stretch_") for name in names):
        raise InvalidValue("fit", list(names), "one stretch for all cables, or one for each")
    return names


class _Fit:
    """The fit; its unknowns x are log EI, nu and s = EI stretch, by which the model is smooth."""

    def __init__(
        self,
        rows: Sequence[Measurement],
        names: tuple[str, ...],
        position_scatter: float | None,
        load_scatter: float | None,
        stiffness: float | None,
    ) -> None:
        self._rows, self._names = rows, names
        self._models = [RowModel(row) for row in rows]
        self._given = {"position": position_scatter, "load": load_scatter}
        kinds = [
            kind
            for row in rows
            for kind in ["position"] * (3 * len(row.positions)) + ["load"] * len(row.loads)
        ]
        self._is_load = np.array([kind == "load" for kind in kinds])
        self._length = max(row.finger.length for row in rows)
        self._largest = max((v for row in rows for v in row.loads.values()), default=0.0)
        self._scatter = np.where(
            self._is_load, load_scatter or 0.05 * self._largest, position_scatter or 1e-3
        )
        self._known_stiffness = stiffness
        self._shown: tuple[tuple[float | None, dict[str, float]], list[Shown]] | None = None
        self.free = list(names)
        self.unknown: dict[str, str] = {}
        nu = rows[0].finger.poisson_ratio
        self._x = {n: nu if n == "nu" else 0.0 for n in names}
        self._x.setdefault("EI", 0.0)
        self._x["EI"] = self._first_stiffness()

    def run(self) -> Calibration:
        self._drop_what_nothing_shows()
        for _ in range(_WEIGHINGS):
            residual, jacobian = self._minimise()
            dropped = self._drop_the_unknown(jacobian)
            if not dropped and not self._weigh(residual):
                break
        residual, jacobian = self._minimise()
        return self._result(residual, jacobian)

    # -- the model ---------------------------------------------------------------------------

    def _first_stiffness(self) -> float:
        if self._known_stiffness is not None:
            return math.log(self._known_stiffness)
        if self._largest > 0:
            ratios = self._ratios()
            if len(ratios):
                return math.log(float(np.median(ratios[:, 1])))
        return math.log(self._rows[0].finger.bending_stiffness)

    def _ratios(self) -> np.ndarray:
        """(k, 2) row and load / tension per EI of every load whose cable the model has taut."""
        found = []
        for i, (row, shown) in enumerate(zip(self._rows, self._all_shown(), strict=True)):
            for load, tension in zip(row.loads.values(), shown.tensions, strict=True):
                if tension > 0:
                    found.append((float(i), load / tension))
        return np.array(found).reshape(-1, 2)

    def _stretch(self, row: Measurement) -> np.ndarray:
        names = row.finger.cable_names
        return np.array([self._x.get("stretch", self._x.get(f"stretch_{n}", 0.0)) for n in names])

    def _all_shown(self) -> list[Shown]:
        nu = self._x["nu"] if "nu" in self.free else None
        shape = {name: value for name, value in self._x.items() if name != "EI"}
        if self._shown is None or self._shown[0] != (nu, shape):
            seen = [model.shown(self._stretch(model.row), nu) for model in self._models]
            self._shown = (nu, shape), seen
        return self._shown[1]

    def _evaluate(self) -> tuple[np.ndarray, np.ndarray]:
        """Residual (r,) and Jacobian (r, free) in units of the scatter."""
        stiffness = math.exp(self._x["EI"])
        off, slopes = [], []
        for row, shown in zip(self._rows, self._all_shown(), strict=True):
            measured = np.array([*row.positions.values()]).reshape(-1, 3)
            loads = np.array([*row.loads.values()])
            off += [(shown.points - measured).ravel(), stiffness * shown.tensions - loads]
            columns = [self._column(name, row, shown, stiffness) for name in self.free]
            count = measured.size + len(loads)
            slopes.append(np.array(columns).T.reshape(count, len(self.free)))
        residual = np.concatenate(off) / self._scatter
        return residual, np.concatenate(slopes) / self._scatter[:, None]

    @staticmethod
    def _column(name: str, row: Measurement, shown: Shown, stiffness: float) -> np.ndarray:
        if name == "EI":  # by log EI
            return np.concatenate([np.zeros(shown.points.size), stiffness * shown.tensions])
        if name == "nu":
            points, tensions = shown.points_by_nu, shown.tensions_by_nu
        else:
            acts = [float(name in ("stretch", f"stretch_{c}")) for c in row.finger.cable_names]
            points, tensions = shown.points_by_stretch @ acts, shown.tensions_by_stretch @ acts
        return np.concatenate([points.ravel(), stiffness * tensions])

    # -- the search --------------------------------------------------------------------------

    def _minimise(self) -> tuple[np.ndarray, np.ndarray]:
        residual, jacobian = self._evaluate()
        damping = 1e-6
        for _ in range(_ROUNDS):
            if not self.free:
                break
            before = dict(self._x)
            gradient = jacobian.T @ residual
            moving = [
                i for i, n in enumerate(self.free) if not self._blocked(n, float(gradient[i]))
            ]
            if not moving:
                break
            part = jacobian[:, moving]
            gauss = part.T @ part
            system = gauss + damping * np.diag(np.maximum(np.diag(gauss), 1e-30))
            step = np.linalg.lstsq(system, -gradient[moving], rcond=None)[0]
            for i, change in zip(moving, step, strict=True):
                name = self.free[i]
                low, high = _BOUNDS[name.partition("_")[0]]
                self._x[name] = float(np.clip(self._x[name] + change, low, high))
            new, slopes = self._evaluate()
            gain = float(residual @ residual - new @ new)
            if gain >= 0:
                still = gain <= _STILL * float(residual @ residual) + 1e-12 * len(residual)
                residual, jacobian, damping = new, slopes, 0.1 * damping
                if still:
                    break
            else:
                self._x, damping = before, max(10.0 * damping, 1e-6)
                if damping > 1e8:
                    break
        return residual, jacobian

    def _blocked(self, name: str, slope: float) -> bool:
        """Whether a parameter is at a bound and would leave its range."""
        low, high = _BOUNDS[name.partition("_")[0]]
        value = self._x[name]
        return (value <= low and slope > 0) or (value >= high and slope < 0)

    def _weigh(self, residual: np.ndarray) -> bool:
        """Estimate the scatters that are not given; tell whether they have changed."""
        before = self._scatter.copy()
        share = max(1.0 - len(self.free) / len(residual), 1.0 / len(residual))
        for kind, of in (("position", ~self._is_load), ("load", self._is_load)):
            if self._given[kind] is None and of.any():
                off = residual[of] * self._scatter[of]
                unit = self._length if kind == "position" else self._largest
                scatter = math.sqrt(float(off @ off) / (of.sum() * share))
                self._scatter[of] = max(scatter, _SMALLEST[kind] * unit)
        return bool(np.abs(self._scatter / before - 1.0).max() > 0.01)

    # -- what is known -----------------------------------------------------------------------

    def _width(self, name: str) -> float:
        """What a parameter is believed to within before anything is measured."""
        if name in _WIDTHS:
            return _WIDTHS[name]
        tension = max(float(s.tensions.max(initial=0.0)) for s in self._all_shown())
        for model in self._models:
            if tension > 0:
                break
            finger = model.row.finger
            tension = max(model.row.pulls.values()) / (finger.length * finger.disk_radius**2)
        return 0.02 * self._length / max(tension, 1e-12)  # a stretch of 2 % of the length

    def _drop_what_nothing_shows(self) -> None:
        if not self._is_load.any() and "EI" in self.free:
            self._hold("EI", "no load was measured, and shapes do not depend on it")

    def _hold(self, name: str, why: str) -> None:
        self.free.remove(name)
        self.unknown[name] = why
        if name != "EI":
            self._x[name] = 0.0 if name != "nu" else self._rows[0].finger.poisson_ratio

    def _drop_the_unknown(self, jacobian: np.ndarray) -> bool:
        """Hold the parameter that the data leave freest, if they leave it free; tell so."""
        if not self.free:
            return False
        widths = np.array([self._width(name) for name in self.free])
        _, sizes, ways = np.linalg.svd(jacobian * widths, full_matrices=False)
        if len(sizes) == len(self.free) and sizes[-1] * _UNKNOWN > 1.0:
            return False
        way = np.abs(ways[-1])
        worst = self.free[int(np.argmax(way))]
        others = [n for n, w in zip(self.free, way, strict=True) if n != worst and w > 0.3]
        if others:
            why = f"the data do not tell it from {' and '.join(others)}"
        else:
            why = "for what the data scatter by, they hardly depend on it"
        self._hold(worst, why)
        return True

    def _result(self, residual: np.ndarray, jacobian: np.ndarray) -> Calibration:
        freedom = len(residual) - len(self.free)
        covariance = np.linalg.pinv(jacobian.T @ jacobian) if self.free else np.zeros((0, 0))
        kinds = (("position", ~self._is_load), ("load", self._is_load))
        estimated = [k for k, of in kinds if of.any() and self._given[k] is None]
        if freedom > 0 and estimated:  # the scatter is itself an estimate
            factor = student(freedom)
        else:
            factor = 1.96
        knows = freedom > 0 or not estimated
        stiffness = math.exp(self._x["EI"])
        known = "EI" in self.free or self._known_stiffness is not None
        known = known or self._rows[0].finger.youngs_modulus is not None
        estimates, products = {}, {}
        gradient = jacobian.T @ residual
        for i, name in enumerate(self.free):
            value, spread = self._x[name], factor * math.sqrt(float(covariance[i, i])) * knows
            bound = self._blocked(name, float(gradient[i])) or value in _BOUNDS[_kind(name)]
            if name == "EI":
                ends = math.exp(value - spread), math.exp(value + spread)
                estimates[name] = Estimate(name, stiffness, *ends, bound)
            elif name == "nu":
                estimates[name] = Estimate(name, value, value - spread, value + spread, bound)
            elif known:  # k = s / EI, to first order
                slope = np.zeros(len(self.free))
                slope[i] = 1.0 / stiffness
                if "EI" in self.free:
                    slope[self.free.index("EI")] = -value / stiffness
                spread = factor * math.sqrt(float(slope @ covariance @ slope)) * knows
                middle = value / stiffness
                estimates[name] = Estimate(name, middle, middle - spread, middle + spread, bound)
            else:
                products[name] = value
                self.unknown[name] = (
                    "without EI only its product with EI is known; measure loads, or give EI"
                )
        return Calibration(
            estimates=estimates,
            unknown=self.unknown,
            position_scatter=self._of(~self._is_load),
            load_scatter=self._of(self._is_load),
            residuals=residual,
            stiffness=self._ratios(),
            products=products,
        )

    def _of(self, kind: np.ndarray) -> float:
        return float(self._scatter[kind][0]) if kind.any() else math.nan


def _kind(name: str) -> str:
    return name.partition("_")[0]
