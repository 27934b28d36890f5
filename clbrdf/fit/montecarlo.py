"""Propagation of distributions: the fit again to many draws of what the values could have been.

A draw is the fitted model with errors of the scan's uncertainty: noise for every value, and one deviate for
each mode of a component that several values have in common, wavelengths included. The polish takes each draw
from the optimum to its own, limits and all, draws beside each other as further wavelengths of one batch. Of
the ends the shortest interval that covers a share p is told: unlike p̂ ± k σ it knows limits and curvature.

Source: JCGM 101:2008, 7 (propagation) and 7.7 (shortest coverage intervals).
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.fit.parts import in_order
from clbrdf.fit.polish import descend
from clbrdf.fit.problem import Problem
from clbrdf.opencl.precision import get_precision
from clbrdf.progress import Report, silent
from clbrdf.records import Record
from clbrdf.scan import Component, Scan

Array = npt.NDArray[np.float64]

COVERAGE = ((0.6827, 1.0), (0.95, 1.959964))
"""Shares of the draws that an interval covers, and how many σ reach as far for a normal distribution."""

FEWEST, MOST = 100, 100_000
"""Draws: below, an interval of 95 % rests on a handful of them."""

BLOCK_VALUES = 1 << 23
"""Values of draws that are fitted at a time: 64 MiB, and as much for their weights."""

MOST_ITERATIONS = 60
TOLERANCE = 1e-7
"""Stop where a step would lower E by less than this, relative: with n values to a fit that is √(1e-7 n) σ of
a parameter, a hundredth for a thousand values."""

DEPARTS = 0.1
"""Share by which an interval differs from the linear one before it is told."""


@dataclass(frozen=True, eq=False)
class MonteCarlo(Record):
    """What draws say of the parameters at W wavelengths; NaN where there is no fit or a parameter is given.

    Attributes
    ----------
    draws, seed : int
    intervals : (2, 2, W, P) float64
        Low and high end of the shortest intervals that cover 68.27 % and 95 % of the draws.
    median : (W, P) float64
    at_bound : (W, P) float64
        Share of the draws that end at a limit.
    converged : (W,) float64
        Share of the draws that came to a stationary point.
    departs : (W, P) bool
        Where interval or median are off the linear ones by more than 10 % of σ, beyond what so many draws
        scatter. Where the linear fit has no σ, at a bound, any interval departs from none.
    seconds : float
        Wall time. Not saved.
    """

    draws: int
    seed: int
    intervals: Array
    median: Array
    at_bound: Array
    converged: Array
    departs: npt.NDArray[np.bool_]
    seconds: float = float("nan")

    def placed(self, places: npt.NDArray[np.intp], count: int) -> MonteCarlo:
        """Return it for `count` wavelengths, of which these were fitted."""

        def wide(some: npt.NDArray[Any], axis: int, fill: Any) -> npt.NDArray[Any]:
            shape = (*some.shape[:axis], count, *some.shape[axis + 1 :])
            out = np.full(shape, fill, dtype=some.dtype)
            out[(slice(None),) * axis + (places,)] = some
            return out

        return replace(
            self,
            intervals=wide(self.intervals, 2, np.nan),
            median=wide(self.median, 0, np.nan),
            at_bound=wide(self.at_bound, 0, np.nan),
            converged=wide(self.converged, 0, np.nan),
            departs=wide(self.departs, 0, False),
        )


def check_draws(draws: int | None) -> None:
    """Raise InputError where a number of draws is none."""
    if draws is None:
        return
    if not isinstance(draws, int) or isinstance(draws, bool) or not FEWEST <= draws <= MOST:
        raise InputError(f"monte_carlo is {draws}; give {FEWEST} to {MOST} draws")


def monte_carlo(
    problem: Problem,
    scan: Scan,
    weights: Array,
    vector: Array,
    sigma: Array,
    bounds: Array,
    draws: int,
    seed: int,
    report: Report = silent,
) -> MonteCarlo:
    """Return what draws say of the parameters of a fit at each of its W wavelengths.

    Parameters
    ----------
    problem : Problem
        Of the scan.
    scan : Scan
        N directions × W wavelengths, all of them fitted.
    weights : (N, W) float64
    vector, sigma : (W, P) float64
        Best parameters and their standard uncertainties, from the linear propagation.
    bounds : (P, 2) float64
    draws, seed : int
    report : callable

    Raises
    ------
    DeviceError
        The device cannot run the polish.
    """
    began, model = time.perf_counter(), problem.model
    (w, n), p = problem.size, len(model.names)
    values = problem.seen.brdf(vector[:, None, :])
    errors = _Errors.of(scan, problem, weights, values, draws, seed)
    known = np.array([j not in problem.free for j in range(p)])
    q = np.stack([row.to_coordinate(vector[:, j]) for j, row in enumerate(model.parameters)], axis=1)
    q = np.clip(q, problem.lower, problem.upper)
    ends, converged = np.empty((w, draws, p)), np.empty((w, draws), dtype=np.bool_)
    at_limit = np.empty((w, draws, p), dtype=np.bool_)
    most = max(1, BLOCK_VALUES // n)
    for k in range(w):
        drawn = errors.draw(k)  # (K, N)
        for first in range(0, draws, most):
            some = slice(first, min(first + most, draws))
            count = some.stop - some.start
            batch = problem.take(np.full(count, k))
            scale = problem.scale[k]
            target = np.where(scale > 0.0, scale * (values[k] + drawn[some]), 0.0)
            batch = replace(batch, target=np.ascontiguousarray(target))
            starts = np.broadcast_to(q[k], (count, 1, p))
            found = descend(batch, starts, get_precision("double"), MOST_ITERATIONS, TOLERANCE)
            coordinates = found.coordinates[:, 0]
            span = np.maximum(problem.upper[k] - problem.lower[k], 1e-300)
            inside = np.minimum(coordinates - problem.lower[k], problem.upper[k] - coordinates)
            at_limit[k, some] = inside <= 1e-9 * span
            ends[k, some] = model.from_coordinates(in_order(model, coordinates, bounds, known))
            converged[k, some] = found.converged[:, 0]
        report(k + 1, w)
    ends[:, :, known], at_limit[:, :, known] = np.nan, False
    return _told(ends, at_limit, converged, vector, sigma, known, seed, time.perf_counter() - began)


@dataclass(frozen=True, eq=False)
class _Errors:
    """Draws of the errors (K, N) at each wavelength, in the order of the problem's directions.

    Attributes
    ----------
    scan : Scan
    order : (N,) int
    values : (W, N) float64
        Of the model, in that order.
    noise : (N, W) float64
        Standard uncertainty of what is random at each value.
    components : sequence of Component
        What is left: with something in common.
    draws, seed : int
    """

    scan: Scan
    order: npt.NDArray[np.intp]
    values: Array
    noise: Array
    components: Sequence[Component]
    draws: int
    seed: int

    @classmethod
    def of(
        cls, scan: Scan, problem: Problem, weights: Array, values: Array, draws: int, seed: int
    ) -> _Errors:
        in_scan = np.empty_like(values)
        in_scan[:, problem.order] = values
        random, used = scan.random_sigma, weights > 0.0
        components = scan.common_components
        if random is not None and np.isfinite(random[used]).all():
            noise, components = random, scan.components
            if scan.components:
                noise = np.sqrt(
                    np.sum([one.absolute(in_scan.T) ** 2 for one in scan.components if one.is_noise], axis=0)
                    * np.ones(scan.brdf.shape)
                )
                components = tuple(one for one in scan.components if not one.is_noise)
        else:
            # As the linear propagation takes it: σ² ∝ 1/g, with the scatter of the residuals.
            left = np.maximum(used.sum(axis=0) - len(problem.free), 1)
            residuals = np.where(used, in_scan.T - np.where(used, scan.brdf, 0.0), 0.0)
            scatter = (weights * residuals**2).sum(axis=0) / left
            noise = np.sqrt(np.where(used, scatter / np.where(used, weights, 1.0), 0.0))
        noise = np.where(used, noise, 0.0)
        return cls(scan, problem.order, in_scan, noise, components, draws, seed)

    def draw(self, k: int) -> Array:
        """Return the errors (K, N) of all draws at the k-th wavelength.

        They follow from the seed, the wavelength and the component alone.
        """
        scan, n = self.scan, len(self.order)
        key = int(scan.column_keys[k])
        out = self._normal(0, key, n) * self.noise[:, k]
        angles = {name: getattr(scan, name) for name in ("theta_i", "theta_r", "phi_r")}
        for place, one in enumerate(self.components):
            u = np.asarray(one.values)[:, k]
            if one.relative:
                u = u * np.abs(self.values[k])
            modes = None if one.is_random else one.direction_modes(angles)
            count = n if modes is None else modes.shape[1]
            if one.wavelength.form == "random":
                deviates = self._normal(1 + place, key, count)
            else:
                over = one.wavelength.modes(scan.wavelength)[k]
                deviates = np.zeros((self.draws, count))
                for mode in np.flatnonzero(over):
                    deviates += over[mode] * self._normal(1 + place, int(mode), count)
            out += (deviates if modes is None else deviates @ modes.T) * u
        return np.asarray(out[:, self.order])

    def _normal(self, what: int, which: int, count: int) -> Array:
        random = np.random.Generator(np.random.Philox(np.random.SeedSequence([self.seed, what, which])))
        return random.standard_normal((self.draws, count))


def _told(
    ends: Array,
    at_limit: npt.NDArray[np.bool_],
    converged: npt.NDArray[np.bool_],
    vector: Array,
    sigma: Array,
    known: npt.NDArray[np.bool_],
    seed: int,
    seconds: float,
) -> MonteCarlo:
    """Return intervals and medians of draws (W, K, P), and where they leave the linear ones."""
    draws = ends.shape[1]
    intervals = np.stack([shortest(ends, share) for share, _ in COVERAGE])
    median = np.median(ends, axis=1)
    # Of normal draws half an interval scatters by 1/√K of itself, the median by 1.25 σ/√K.
    slack = 2.0 / np.sqrt(draws)
    with np.errstate(invalid="ignore", divide="ignore"):
        departs = np.abs(median - vector) > (DEPARTS + 1.25 * slack) * sigma
        for (_, reach), (low, high) in zip(COVERAGE, intervals, strict=True):
            departs |= np.abs((high - low) / (2.0 * reach * sigma) - 1.0) > DEPARTS + slack
    departs |= np.isnan(sigma) & ~known
    departs &= ~np.isinf(sigma)
    return MonteCarlo(
        draws, seed, intervals, median, at_limit.mean(axis=1), converged.mean(axis=1), departs, seconds
    )


def shortest(draws: Array, share: float) -> Array:
    """Return the ends (2, W, P) of the shortest intervals that cover a share of draws (W, K, P)."""
    count = draws.shape[1]
    inside = min(int(share * count + 0.5), count - 1)
    ordered = np.sort(draws, axis=1)
    width = ordered[:, inside:] - ordered[:, : count - inside]
    first = np.argmin(width, axis=1)[:, None]
    low = np.take_along_axis(ordered, first, axis=1)[:, 0]
    high = np.take_along_axis(ordered, first + inside, axis=1)[:, 0]
    return np.stack([low, high])
