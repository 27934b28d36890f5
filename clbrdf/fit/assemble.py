"""From a solution to a Fit: parameters, their uncertainties, what the data leave open, status."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.fit.identifiability import remarks
from clbrdf.fit.layout import Layout
from clbrdf.fit.parts import in_order
from clbrdf.fit.problem import Problem
from clbrdf.fit.result import Fit
from clbrdf.fit.shared_uncertainty import shared_uncertainty, with_shared
from clbrdf.fit.solve import Solution
from clbrdf.fit.summary import summarise_scan
from clbrdf.fit.uncertainty import uncertainty
from clbrdf.models import Model
from clbrdf.scan import Scan

Array = npt.NDArray[np.float64]

NEGLIGIBLE = 1e-9
"""Share of E that setting a parameter to 0 may cost."""

BOUND_TOLERANCE = 1e-9
"""A coordinate this near its limit, as a share of its range, is at the limit."""


def assemble(
    scan: Scan,
    model: Model,
    fitted: npt.NDArray[np.intp],
    solution: Solution,
    *,
    covariance: Array | None,
    weights: Array,
    layout: Layout,
    problem_of: Callable[[npt.NDArray[np.intp]], Problem],
    bounds: Array,
    given: Mapping[str, Array],
    shared: tuple[str, ...],
    method: str,
    device: str,
    seed: int,
    provenance: Mapping[str, str],
    tolerance: tuple[str, ...],
    start: float,
) -> Fit:
    """Return the fit of a scan from its solution; `fitted` are the places of the wavelengths.

    `problem_of` returns the problem at some wavelengths, by their places, in a `layout` of the directions;
    `given` are the parameters (W,) that were not fitted, `shared` those that are one number for all
    wavelengths. `covariance` (W, P, P), of the coordinates, replaces the one of the data alone. `start` is
    the reading of `time.perf_counter` when the fit began.
    """
    w, seen = len(scan.wavelength), layout.seen.take(np.argsort(layout.order))
    limits = model.coordinate_bounds(bounds)
    known = np.array([name in given for name in model.names])
    in_common = np.array([name in shared for name in model.names])
    coordinates = in_order(model, solution.coordinates, bounds, known, in_common)
    vector, at_bound = settle(model, coordinates, limits, bounds)
    for name, spectrum in given.items():
        vector[:, model.names.index(name)] = spectrum[fitted]
    at_bound &= ~known

    sums = summarise_scan(scan, weights, layout, problem_of, fitted, vector)
    # A floor that stands for 0 counts where another factor is large enough: it stays what it is there.
    floored = np.array([row.scale == "log" for row in model.parameters])
    zero = (vector == 0.0) & floored & ~known
    counts = zero.any(axis=1) & (sums.objective > solution.objective * (1.0 + NEGLIGIBLE))
    if counts.any() and zero[:, in_common].any():
        counts[:] = True
    if counts.any():
        again = np.flatnonzero(counts)
        vector[again] = np.where(zero[again], model.from_coordinates(limits[:, 0]), vector[again])
        sums.put(again, summarise_scan(scan, weights, layout, problem_of, fitted[again], vector[again]))
    result = uncertainty(sums.gram, sums.spread, sums.objective, sums.used, at_bound | known | in_common)
    together = np.flatnonzero(in_common & ~at_bound.any(axis=0))
    if len(together):
        own = ~(at_bound | known | in_common)
        measured = np.where(weights[:, fitted] > 0.0, scan.brdf[:, fitted], 0.0).T
        residuals = seen.brdf(vector[:, None, :]) - measured
        sigmas = None if scan.sigma is None else scan.sigma[:, fitted].T
        data = residuals, weights[:, fitted].T, sigmas
        result = with_shared(result, *shared_uncertainty(seen, vector, own, together, *data), together)

    def placed(values: Any, fill: Any) -> Any:
        out = np.full((w, *values.shape[1:]), fill, dtype=values.dtype)
        out[fitted] = values
        return out

    with np.errstate(invalid="ignore"):  # nothing counts
        rms_by_angle = np.sqrt(sums.deviation / sums.counted)
        rms = np.sqrt(sums.deviation.sum(axis=1) / sums.counted.sum(axis=1))
    deviation = result.sigma
    if covariance is not None:
        slopes = [abs(row.slope(vector[:, j])) for j, row in enumerate(model.parameters)]
        deviation = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)) * np.stack(slopes, axis=1)
        deviation[at_bound | known] = np.nan
    parameters, sigma = placed(vector, np.nan), placed(deviation, np.nan)
    correlation = placed(result.correlation, np.nan)
    status = np.full(w, "no data", dtype="<U13")
    for j, place in enumerate(fitted):
        converged, determined = bool(solution.converged[j]), bool(result.determined[j])
        status[place] = _status(converged, determined, bool(at_bound[j].any()))

    return Fit(
        scan=scan,
        model=model,
        parameters=dict(zip(model.names, parameters.T.copy(), strict=True)),
        sigma=dict(zip(model.names, sigma.T.copy(), strict=True)),
        objective=placed(sums.objective, np.nan),
        relative_rms=placed(rms, np.nan),
        relative_rms_by_incident_angle=placed(rms_by_angle, np.nan).T.copy(),
        status=status,
        correlation=correlation,
        condition=placed(result.condition, np.nan),
        remarks=remarks(
            seen,
            scan,
            parameters,
            placed(result.undetermined, False),
            placed(at_bound, False),
            correlation,
            weights > 0.0,
            int(np.count_nonzero(~known)),
        ),
        evaluations=placed(solution.evaluations, 0),
        starts=placed(solution.starts, 0),
        agreeing=placed(solution.agreeing, 0),
        acceptance=placed(solution.acceptance, np.nan),
        not_finite=placed(solution.not_finite, 0),
        weights=weights,
        bounds=bounds,
        given=tuple(given),
        shared=shared,
        method=method,
        device=device,
        seed=seed,
        provenance=provenance,
        tolerance=tolerance,
        seconds=time.perf_counter() - start,
    )


def _status(converged: bool, determined: bool, at_bound: bool) -> str:
    if not converged:
        return "not converged"
    if not determined:
        return "ambiguous"
    return "at bound" if at_bound else "converged"


def settle(
    model: Model, coordinates: Array, limits: Array, bounds: Array
) -> tuple[Array, npt.NDArray[np.bool_]]:
    """Turn coordinates (W, P) into parameters, those at a limit set to it exactly; say which they are.

    A parameter on a log scale that has reached the floor near 0 is 0.
    """
    span = limits[:, 1] - limits[:, 0]
    at_low = coordinates - limits[:, 0] <= BOUND_TOLERANCE * span
    at_high = limits[:, 1] - coordinates <= BOUND_TOLERANCE * span
    values = model.from_coordinates(coordinates)
    for j, parameter in enumerate(model.parameters):
        falls = parameter.scale == "log" and parameter.sign < 0.0
        low, high = bounds[j][::-1] if falls else bounds[j]
        values[at_low[:, j], j] = low
        values[at_high[:, j], j] = high
    return values, at_low | at_high
