"""From the estimate of a fit to profile-likelihood intervals of its parameters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from clbrdf.fit.problem import Problem
from clbrdf.fit.profile import profile_intervals
from clbrdf.fit.records import Estimate, Setup
from clbrdf.fit.summary import Summary
from clbrdf.fit.uncertainty import uncertainty
from clbrdf.models import Model

Array = npt.NDArray[np.float64]


def with_intervals(
    problem: Problem, sums: Summary, model: Model, setup: Setup, estimate: Estimate
) -> Estimate:
    """Return an estimate with its intervals; problem and sums are those of the fitted wavelengths."""
    fitted = setup.fitted
    vector = estimate.vector[fitted]
    known = np.array([name in setup.fixed for name in model.names]) & np.ones(vector.shape, dtype=np.bool_)
    # With all parameters free: those at a limit may leave it along a profile.
    told = uncertainty(sums.gram, sums.spread, sums.objective, sums.used, known).sigma
    unknown = np.full_like(sums.spread, np.nan)
    scattered = uncertainty(sums.gram, unknown, sums.objective, sums.used, known).sigma
    count = sums.used - (~known).sum(axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = (told / scattered) ** 2
        # Where the data cannot tell a parameter, its variance has no ratio; that of the others stands for it.
        typical = np.nanmedian(np.where(np.isfinite(ratio), ratio, np.nan), axis=1, keepdims=True)
        ratio = np.where(np.isfinite(ratio), ratio, typical)
        rise = ratio * np.where(count > 0, sums.objective / count, np.nan)[:, None]
        slopes = [abs(row.slope(vector[:, j])) for j, row in enumerate(model.parameters)]
        deviation = told / np.stack(slopes, axis=1)
    best = np.clip(model.to_coordinates(vector), problem.lower, problem.upper)
    ends = profile_intervals(problem, best, np.where(known, np.nan, rise), deviation)
    out = []
    for end in ends:
        values = np.full(estimate.vector.shape, np.nan)
        values[fitted] = _values(model, setup, problem, end)
        out.append(values)
    # A parameter that falls as its coordinate rises has its ends exchanged.
    lower, upper = np.fmin(*out), np.fmax(*out)
    return replace(estimate, lower=lower, upper=upper)


def _values(model: Model, setup: Setup, problem: Problem, end: Array) -> Array:
    """Return coordinates (K, P) as parameters, those at a limit as the limit itself."""
    values = model.from_coordinates(end)
    for j, row in enumerate(model.parameters):
        falls = row.scale == "log" and row.sign < 0.0
        low, high = setup.bounds[j][::-1] if falls else setup.bounds[j]
        values[end[:, j] == problem.lower[:, j], j] = low
        values[end[:, j] == problem.upper[:, j], j] = high
    return values
