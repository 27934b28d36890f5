"""Figures of merit of optimizers: success rates, expected running times, ECDF with bands, data profiles.

ERT     cost over all runs until the target (or the end), divided by the number of successes
(Hansen, Auger, Ros, Finck and Posik, GECCO 2010 companion, 1689; the BBOB practice)
ECDF    share of all (wavelength, seed, target) reached within a cost
data profile    share of the wavelengths solved to one target within κ (P + 1) evaluations, solved where
the median seed is (after More and Wild, SIAM J. Optim. 20 (2009) 172)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from clbrdf.bench.comparison import TARGETS, OptimizerRun

Array = npt.NDArray[np.float64]

RESAMPLES = 200
BAND = (5.0, 95.0)
"""Percentiles of the bootstrap."""


@dataclass(frozen=True, eq=False)
class Costs:
    """All runs of one contender.

    Attributes
    ----------
    contender : str
    evaluations, seconds : (I, S, T) float64
        Cost of each target for I wavelengths and S seeds; infinite where it was not reached.
    spent, elapsed : (I, S) float64
        Cost in all.
    problems : (I,) str
    wavelengths : (I,) float64
        nm.
    """

    contender: str
    evaluations: Array
    seconds: Array
    spent: Array
    elapsed: Array
    problems: npt.NDArray[np.str_]
    wavelengths: Array

    def only(self, problem: str) -> Costs:
        """Return the runs on one problem."""
        rows = self.problems == problem
        arrays = ("evaluations", "seconds", "spent", "elapsed", "problems", "wavelengths")
        return replace(self, **{name: getattr(self, name)[rows] for name in arrays})

    def of(self, axis: str) -> tuple[Array, Array]:
        """Return the costs of targets and in all, along "evaluations" or "seconds"."""
        if axis == "evaluations":
            return self.evaluations, self.spent
        return self.seconds, self.elapsed


def costs_of(runs: Sequence[OptimizerRun], contender: str) -> Costs:
    """Gather the runs of a contender, which has as many seeds on each wavelength."""
    places: dict[tuple[str, float], list[OptimizerRun]] = {}
    for run in runs:
        if run.contender == contender:
            places.setdefault((run.problem, run.wavelength), []).append(run)
    rows = list(places.values())
    return Costs(
        contender=contender,
        evaluations=np.array([[run.evaluations for run in row] for row in rows]),
        seconds=np.array([[run.seconds for run in row] for row in rows]),
        spent=np.array([[run.spent for run in row] for row in rows]),
        elapsed=np.array([[run.elapsed for run in row] for row in rows]),
        problems=np.array([problem for problem, _ in places]),
        wavelengths=np.array([wavelength for _, wavelength in places]),
    )


def success_rates(costs: Costs) -> Array:
    """Share of the runs that reach each target, (T,)."""
    reached: Array = np.isfinite(costs.evaluations).mean(axis=(0, 1))
    return reached


def expected_running_time(costs: Costs, axis: str) -> Array:
    """ERT of each target, (T,), along "evaluations" or "seconds"; infinite without a success."""
    to_target, whole = costs.of(axis)
    reached = np.isfinite(to_target)
    total = np.where(reached, to_target, whole[:, :, None]).sum(axis=(0, 1))
    hits = reached.sum(axis=(0, 1))
    ert: Array = np.divide(total, hits, out=np.full(len(hits), np.inf), where=hits > 0)
    return ert


def ecdf(to_target: Array, grid: Array) -> Array:
    """Share of all (I, S, T) costs at or below each of a grid of budgets (B,)."""
    ordered = np.sort(to_target, axis=None)
    share: Array = np.searchsorted(ordered, grid, side="right") / to_target.size
    return share


def ecdf_band(to_target: Array, grid: Array, seed: int = 0) -> tuple[Array, Array]:
    """Return the bootstrap band of the ECDF, (B,) each: wavelengths drawn anew, and seeds within each."""
    rng = np.random.default_rng(seed)
    i, s, _ = to_target.shape
    draws = np.empty((RESAMPLES, len(grid)))
    for k in range(RESAMPLES):
        rows = rng.integers(i, size=(i, 1))
        draws[k] = ecdf(to_target[rows, rng.integers(s, size=(i, s))], grid)
    return np.percentile(draws, BAND[0], axis=0), np.percentile(draws, BAND[1], axis=0)


def data_profile(costs: Costs, target: float, grid: Array, parameters: int) -> Array:
    """Share of the wavelengths solved to a target within κ (P + 1) evaluations, for κ of a grid (B,)."""
    place = TARGETS.index(target)
    middle = np.sort(costs.evaluations[:, :, place], axis=1)[:, (costs.evaluations.shape[1] - 1) // 2]
    share: Array = np.searchsorted(np.sort(middle), grid * (parameters + 1), side="right") / len(middle)
    return share
