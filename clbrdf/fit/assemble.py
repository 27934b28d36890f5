"""From a solution to what a fit says: parameters, their uncertainties, how good they are, status."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.fit.parts import in_order
from clbrdf.fit.records import Estimate, Goodness, Setup
from clbrdf.fit.shared_uncertainty import shared_uncertainty, with_shared
from clbrdf.fit.solve import Solution
from clbrdf.fit.uncertainty import Uncertainty, uncertainty
from clbrdf.models import Model
from clbrdf.objective import objective, relative_rms, relative_rms_by_incident_angle
from clbrdf.observation import ForwardModel
from clbrdf.scan import Scan

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

NEGLIGIBLE = 1e-9
"""Share of E that setting a parameter to 0 may cost."""

BOUND_TOLERANCE = 1e-9
"""A coordinate this near its limit, as a share of its range, is at the limit."""


def assemble(
    scan: Scan,
    seen: ForwardModel,
    setup: Setup,
    solution: Solution,
    covariance: Array | None = None,
    slit: Array | None = None,
) -> tuple[Estimate, Goodness, npt.NDArray[np.str_]]:
    """Return estimate, goodness and status (W,) of a fit from its solution at the fitted wavelengths.

    `seen` is the model as the detector sees it in the scan's directions.
    `covariance` (K, P, P), of the coordinates at the K fitted wavelengths, replaces the one of the data
    alone. `slit` (K, K) says what each of them is seen as.
    """
    fitted, model = setup.fitted, seen.model
    known = np.array([name in setup.fixed for name in model.names])
    vector, at_bound, values = _settled(scan, seen, setup, solution, known)
    if slit is not None:
        values = slit @ values
    result = _uncertainty(scan, seen, setup, vector, at_bound, values)
    deviation = result.sigma
    if covariance is not None:
        slopes = [abs(row.slope(vector[:, j])) for j, row in enumerate(model.parameters)]
        deviation = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)) * np.stack(slopes, axis=1)
        deviation[at_bound | known] = np.nan

    def placed(some: npt.NDArray[Any], fill: Any) -> npt.NDArray[Any]:
        out = np.full((len(scan.wavelength), *some.shape[1:]), fill, dtype=some.dtype)
        out[fitted] = some
        return out

    estimate = Estimate(
        vector=placed(vector, np.nan),
        sigma=placed(deviation, np.nan),
        correlation=placed(result.correlation, np.nan),
        condition=placed(result.condition, np.nan),
        at_bound=placed(at_bound, False),
        undetermined=placed(result.undetermined, False),
    )
    status = np.where(at_bound.any(axis=1), "at bound", "converged").astype("<U13")
    status[~result.determined] = "ambiguous"
    status[~solution.converged] = "not converged"
    everywhere = np.full(scan.brdf.shape, np.nan)
    everywhere[:, fitted] = values.T
    return estimate, goodness(scan, setup, everywhere), placed(status, "no data")


def goodness(scan: Scan, setup: Setup, values: Array) -> Goodness:
    """Return how well model values (N, W), 1/sr, meet a scan."""
    return Goodness(
        objective=objective(values, scan, setup.weights),
        relative_rms=relative_rms(values, scan),
        relative_rms_by_incident_angle=relative_rms_by_incident_angle(values, scan),
    )


def _settled(
    scan: Scan, seen: ForwardModel, setup: Setup, solution: Solution, known: Mask
) -> tuple[Array, Mask, Array]:
    """Return parameters (K, P), which stand at a limit, and model values (K, N) at the fitted wavelengths."""
    fitted, bounds, model = setup.fitted, setup.bounds, seen.model
    limits = model.coordinate_bounds(bounds)
    in_common = np.array([name in setup.shared for name in model.names])
    coordinates = in_order(model, solution.coordinates, bounds, known, in_common)
    vector, at_bound = settle(model, coordinates, limits, bounds)
    for name, spectrum in setup.fixed.items():
        vector[:, model.names.index(name)] = spectrum[fitted]
    at_bound &= ~known

    values = seen.brdf(vector[:, None, :])
    # A floor that stands for 0 counts where another factor is large enough: it stays what it is there.
    energy = objective(values.T, scan.columns(fitted), setup.weights[:, fitted])
    floored = np.array([row.scale == "log" for row in model.parameters])
    zero = (vector == 0.0) & floored & ~known
    counts = zero.any(axis=1) & (energy > solution.objective * (1.0 + NEGLIGIBLE))
    if counts.any() and zero[:, in_common].any():
        counts[:] = True
    for k in np.flatnonzero(counts):
        vector[k] = np.where(zero[k], model.from_coordinates(limits[:, 0]), vector[k])
        values[k] = seen.brdf(vector[k, None, :])
    return vector, at_bound, values


def _uncertainty(
    scan: Scan, seen: ForwardModel, setup: Setup, vector: Array, at_bound: Mask, values: Array
) -> Uncertainty:
    """Return the uncertainties at the fitted wavelengths, of shared parameters those of all together."""
    fitted, model = setup.fitted, seen.model
    known = np.array([name in setup.fixed for name in model.names])
    in_common = np.array([name in setup.shared for name in model.names])
    g = setup.weights[:, fitted]
    data = (
        values - np.where(g > 0.0, scan.brdf[:, fitted], 0.0).T,
        g.T,
        None if scan.sigma is None else scan.sigma[:, fitted].T,
    )
    result = uncertainty(seen, vector, at_bound | known | in_common, *data)
    together = np.flatnonzero(in_common & ~at_bound.any(axis=0))
    if len(together):
        own = ~(at_bound | known | in_common)
        result = with_shared(result, *shared_uncertainty(seen, vector, own, together, *data), together)
    return result


def settle(model: Model, coordinates: Array, limits: Array, bounds: Array) -> tuple[Array, Mask]:
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
