"""From the ends of the polish to a Fit: the best end, its uncertainties, its status."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from clbrdf.fit.polish import Polished
from clbrdf.fit.problem import Candidates
from clbrdf.fit.result import Fit
from clbrdf.fit.uncertainty import uncertainty
from clbrdf.models import Model
from clbrdf.objective import objective, relative_rms, relative_rms_by_incident_angle
from clbrdf.scan import Scan

Array = npt.NDArray[np.float64]
T = TypeVar("T", bound=np.generic)

BOUND_TOLERANCE = 1e-9
"""A coordinate this near its limit, as a share of its range, is at the limit."""


def assemble(
    scan: Scan,
    model: Model,
    fitted: npt.NDArray[np.intp],
    parts: Sequence[tuple[Candidates, Polished]],
    *,
    weights: Array,
    bounds: Array,
    method: str,
    device: str,
    seed: int,
    provenance: Mapping[str, str],
    start: float,
) -> Fit:
    """Return the fit of a scan from the results of its blocks; `fitted` are the places of the wavelengths.

    `start` is the reading of `time.perf_counter` when the fit began.
    """
    w, p = len(scan.wavelength), len(model.parameters)
    coordinates = np.concatenate([polished.coordinates for _, polished in parts])
    ends = np.concatenate([polished.objective for _, polished in parts])
    best = np.nanargmin(np.where(np.isfinite(ends), ends, np.inf), axis=1)
    rows = np.arange(len(fitted))
    limits = model.coordinate_bounds(bounds)
    vector, at_bound = settle(model, coordinates[rows, best], limits, bounds)
    converged = np.concatenate([polished.converged for _, polished in parts])[rows, best]

    parameters, sigma = np.full((w, p), np.nan), np.full((w, p), np.nan)
    status = np.full(w, "no data", dtype="<U13")
    parameters[fitted] = vector
    features = model.features(scan.directions)
    for k, place in enumerate(fitted):
        result = uncertainty(
            model,
            features,
            vector[k],
            at_bound[k],
            scan.brdf[:, place],
            weights[:, place],
            None if scan.sigma is None else scan.sigma[:, place],
        )
        sigma[place] = result.sigma
        status[place] = _status(bool(converged[k]), result.determined, bool(at_bound[k].any()))

    def spread(values: npt.NDArray[T], fill: float) -> npt.NDArray[T]:
        out = np.full(w, fill, dtype=values.dtype)
        out[fitted] = values
        return out

    found = [candidates for candidates, _ in parts]
    spent = np.concatenate([c.evaluations for c in found])
    spent += np.concatenate([polished.evaluations.sum(axis=1) for _, polished in parts])
    values = model.brdf(parameters[:, None, :], features).T
    return Fit(
        scan=scan,
        model=model,
        parameters=dict(zip(model.names, parameters.T.copy(), strict=True)),
        sigma=dict(zip(model.names, sigma.T.copy(), strict=True)),
        objective=objective(values, scan, weights),
        relative_rms=relative_rms(values, scan),
        relative_rms_by_incident_angle=relative_rms_by_incident_angle(values, scan),
        status=status,
        evaluations=spread(spent, 0),
        acceptance=spread(np.concatenate([c.acceptance for c in found]), np.nan),
        not_finite=spread(np.concatenate([c.not_finite for c in found]), 0),
        weights=weights,
        bounds=bounds,
        method=method,
        device=device,
        seed=seed,
        provenance=provenance,
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
