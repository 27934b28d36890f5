"""From a solution to what a fit says: parameters, their uncertainties, how good they are, status."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.fit.carried import Part, carried, total
from clbrdf.fit.correlated import correlated_chi2, has_common_errors
from clbrdf.fit.gls import PrecisionMatrix
from clbrdf.fit.goodness import deviation_tests
from clbrdf.fit.layout import Layout
from clbrdf.fit.parts import in_order
from clbrdf.fit.problem import Problem
from clbrdf.fit.records import Estimate, Goodness, Setup
from clbrdf.fit.shared_uncertainty import SharedSystem, common_share, shared_uncertainty, with_shared
from clbrdf.fit.smooth import Tied
from clbrdf.fit.solve import Solution
from clbrdf.fit.summary import Summary, summarise_scan
from clbrdf.fit.uncertainty import Uncertainty, uncertainty, with_covariance
from clbrdf.models import Model
from clbrdf.objective import objective
from clbrdf.opencl.device import Device
from clbrdf.opencl.precision import get_precision
from clbrdf.opencl.values import mean_over
from clbrdf.scan import Scan

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

NEGLIGIBLE = 1e-9
"""Share of E that setting a parameter to 0 may cost."""

BOUND_TOLERANCE = 1e-9
"""A coordinate this near its limit, as a share of its range, is at the limit."""


def assemble(
    scan: Scan,
    layout: Layout,
    problem_of: Callable[[npt.NDArray[np.intp]], Problem],
    setup: Setup,
    solution: Solution,
    device: Device,
    tied: Tied | None = None,
    slit: Array | None = None,
    usual: Array | None = None,
) -> tuple[Estimate, Goodness, npt.NDArray[np.str_]]:
    """Return estimate, goodness and status (W,) of a fit from its solution at the fitted wavelengths.

    `layout` says how the directions lie in the problems that `problem_of` returns for places of wavelengths;
    `tied` tells what a penalty on neighbours makes of the uncertainties, `slit` (K, K) what each of the K
    fitted wavelengths is seen as. `usual` (K, N) are the values that weigh a fit by generalised least
    squares.
    """
    fitted, model = setup.fitted, layout.seen.model
    known = np.array([name in setup.fixed for name in model.names])

    def summed(places: npt.NDArray[np.intp], vector: Array) -> Summary:
        return summarise_scan(scan, setup.weights, layout, problem_of, places, vector)

    vector, at_bound, sums = _settled(model, setup, solution, known, summed)
    if slit is not None:
        mixed = slit @ model_values(scan, layout, vector, device)
        sums = _behind_slit(scan, setup, sums, mixed)
    result, parts = _uncertainty(scan, layout, setup, vector, at_bound, sums, tied, usual)

    def placed(some: npt.NDArray[Any], fill: Any) -> npt.NDArray[Any]:
        out = np.full((len(scan.wavelength), *some.shape[1:]), fill, dtype=some.dtype)
        out[fitted] = some
        return out

    estimate = Estimate(
        vector=placed(vector, np.nan),
        sigma=placed(result.sigma, np.nan),
        correlation=placed(result.correlation, np.nan),
        condition=placed(result.condition, np.nan),
        at_bound=placed(at_bound, False),
        undetermined=placed(result.undetermined, False),
        parts=tuple(
            replace(
                part,
                own=placed(part.own, np.nan),
                modes=np.moveaxis(placed(np.moveaxis(part.modes, 1, 0), np.nan), 0, 1),
            )
            for part in parts
        ),
    )
    status = np.where(at_bound.any(axis=1), "at bound", "converged").astype("<U13")
    status[~result.determined] = "ambiguous"
    status[~solution.converged] = "not converged"
    where = placed(status, "no data")
    where[~scan.mask.all(axis=0) & ~(setup.weights > 0.0).any(axis=0)] = "no weight"
    with np.errstate(invalid="ignore"):  # where nothing counts
        by_angle = np.sqrt(sums.deviation / sums.counted)
        rms = np.sqrt(sums.deviation.sum(axis=1) / sums.counted.sum(axis=1))
    energy = placed(sums.objective, np.nan)

    def values_of(places: npt.NDArray[np.intp]) -> Array:
        if slit is not None:
            return np.asarray(mixed[np.searchsorted(fitted, places)])
        return model_values(scan, layout, estimate.vector[places], device)

    tests = deviation_tests(scan, setup, estimate.at_bound, energy, values_of)
    if has_common_errors(scan) and slit is None:
        seen = layout.seen.take(np.argsort(layout.order))
        chi2 = correlated_chi2(seen, scan, setup, estimate) / tests["degrees"]
        tests["chi2_reduced"] = np.where(np.isfinite(chi2), chi2, tests["chi2_reduced"])
    found = Goodness(
        objective=energy,
        relative_rms=placed(rms, np.nan),
        relative_rms_by_incident_angle=placed(by_angle, np.nan).T.copy(),
        **tests,
    )
    return estimate, found, where


def _behind_slit(scan: Scan, setup: Setup, sums: Summary, values: Array) -> Summary:
    """Return the sums with E and deviations of values (K, N) that a slit has mixed."""
    fitted = setup.fitted
    energy = objective(values.T, scan.columns(fitted), setup.weights[:, fitted])
    measured, usable = scan.brdf[:, fitted], ~scan.mask[:, fitted] & (scan.brdf[:, fitted] > 0.0)
    away = np.divide(values.T - measured, measured, out=np.zeros_like(measured), where=usable) ** 2
    _, angle = np.unique(scan.theta_i, return_inverse=True)
    deviation, counted = np.zeros_like(sums.deviation.T), np.zeros_like(sums.counted.T)
    np.add.at(deviation, angle, away)
    np.add.at(counted, angle, usable)
    return replace(sums, objective=energy, deviation=deviation.T, counted=counted.T)


def model_values(scan: Scan, layout: Layout, vector: Array, device: Device) -> Array:
    """Return what the detector sees (B, N), 1/sr, of parameters (B, P), in the order of the scan."""
    model = layout.seen.model
    if layout.seen.first is None:
        x, values = layout.features[:, None, :], np.empty((len(vector), len(scan)))
        seen = mean_over(model, vector[:, None, :], x, None, None, get_precision("double"), device)
        values[:, layout.order] = seen.T
        return values
    values = np.empty((len(vector), len(scan)))
    values[:, layout.order] = layout.seen.brdf(vector[:, None, :])
    return values


def _settled(
    model: Model,
    setup: Setup,
    solution: Solution,
    known: Mask,
    summed: Callable[[npt.NDArray[np.intp], Array], Summary],
) -> tuple[Array, Mask, Summary]:
    """Return parameters (K, P), which stand at a limit, and the sums at the fitted wavelengths."""
    fitted, bounds = setup.fitted, setup.bounds
    limits = model.coordinate_bounds(bounds)
    in_common = np.array([name in setup.shared for name in model.names])
    coordinates = in_order(model, solution.coordinates, bounds, known, in_common)
    vector, at_bound = settle(model, coordinates, limits, bounds)
    for name, spectrum in setup.fixed.items():
        vector[:, model.names.index(name)] = spectrum[fitted]
    at_bound &= ~known

    sums = summed(fitted, vector)
    # A floor that stands for 0 counts where another factor is large enough: it stays what it is there.
    floored = np.array([row.scale == "log" for row in model.parameters])
    zero = (vector == 0.0) & floored & ~known
    counts = zero.any(axis=1) & (sums.objective > solution.objective * (1.0 + NEGLIGIBLE))
    if counts.any() and zero[:, in_common].any():
        counts[:] = True
    again = np.flatnonzero(counts)
    if len(again):
        vector[again] = np.where(zero[again], model.from_coordinates(limits[:, 0]), vector[again])
        sums.put(again, summed(fitted[again], vector[again]))
    return vector, at_bound, sums


def _uncertainty(
    scan: Scan,
    layout: Layout,
    setup: Setup,
    vector: Array,
    at_bound: Mask,
    sums: Summary,
    tied: Tied | None,
    usual: Array | None,
) -> tuple[Uncertainty, tuple[Part, ...]]:
    """Return the uncertainties at the fitted wavelengths, and the parts that make them."""
    fitted, model = setup.fitted, layout.seen.model
    known = np.array([name in setup.fixed for name in model.names])
    in_common = np.array([name in setup.shared for name in model.names])
    own = ~(at_bound | known | in_common)
    result = uncertainty(sums.gram, sums.spread, sums.objective, sums.used, ~own)
    is_known = bool(np.isfinite(sums.spread).all())
    together, system = np.flatnonzero(in_common & ~at_bound.any(axis=0)), None
    if len(together) or scan.components:
        # What wavelengths or values have in common needs every value of every one.
        seen, measured = layout.seen.take(np.argsort(layout.order)), scan.columns(fitted)
        g, values = setup.weights[:, fitted], seen.brdf(vector[:, None, :])
    if len(together):
        random = measured.random_sigma
        residuals = values - np.where(g > 0.0, measured.brdf, 0.0).T
        data = residuals, g.T, None if random is None else random.T
        covariance, is_open, system = shared_uncertainty(seen, vector, own, together, *data)
        result = with_shared(result, covariance, is_open, system)
    alone = _alone(vector, model, result, system, is_known, tied)
    parts: tuple[Part, ...] = (alone,)
    from_file = is_known and tied is None
    if scan.components if from_file else scan.common_components:
        components = measured.components if from_file else measured.common_components
        # The weights of the values as of the usual optimum, as they were fitted.
        precision = PrecisionMatrix.of(measured, g, usual) if usual is not None else None
        where = measured.directions, measured.wavelength
        told = carried(seen, *where, components, vector, own, values, g.T, system, precision)
        slopes = _slopes(model, vector)
        parts = told if from_file else (alone, *(_tied(part, slopes, tied) for part in told))
    held = at_bound | known
    return with_covariance(result, total(parts), held), parts


def _alone(
    vector: Array,
    model: Model,
    result: Uncertainty,
    system: SharedSystem | None,
    is_known: bool,
    tied: Tied | None,
) -> Part:
    """Return the part of what differs from value to value, where no components say what it comes from."""
    w, p = vector.shape
    name = "uncertainty of the values" if is_known else "scatter of the residuals"
    covariance, modes = result.covariance, np.zeros((0, w, p))
    if tied is not None:
        slopes = _slopes(model, vector)
        name = "scatter of the residuals, with the penalty"
        covariance = tied.covariance * slopes[:, :, None] * slopes[:, None, :]
    elif system is not None and np.isfinite(covariance).all():
        of_shared = covariance[0][np.ix_(system.places, system.places)]
        modes = common_share(system, of_shared)
        covariance = covariance - np.einsum("mwp,mwq->wpq", modes, modes)
    return Part(name, "every value for itself", covariance, modes, is_common=False)


def _slopes(model: Model, vector: Array) -> Array:
    """Return the derivatives (W, P) of parameters by their coordinates."""
    return np.stack([row.slope(vector[:, j]) for j, row in enumerate(model.parameters)], axis=1)


def _tied(part: Part, slopes: Array, tied: Tied | None) -> Part:
    """Return a part as a penalty on neighbours lets it through."""
    if tied is None or len(part.modes) == 0:
        return part
    safe = np.where(slopes == 0.0, 1.0, slopes)
    return replace(part, modes=tied.answer(part.modes / safe) * slopes)


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
