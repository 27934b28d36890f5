"""Whether error bars cover what they claim: made scans, fitted with and without correlations of errors.

Each made scan has noise of every value, one scale error, and for each incident angle one error of the angle.
All scans of a model are columns of one, with errors that columns do not share: one fit does them all. Beside
the fit that carries the components stands the one that takes the same total for independent.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.fit import Fit, fit
from clbrdf.geometry import Directions
from clbrdf.models import Model, get_model
from clbrdf.opencl.device import Device
from clbrdf.progress import Report, silent
from clbrdf.scan import Component, Correlation, Scan

Array = npt.NDArray[np.float64]

NOISE, SCALE, ANGLE = 0.005, 0.03, 0.02
"""Standard uncertainties: of each value and of the scale, relative; of the incident angle, degrees."""

CASES: Mapping[str, tuple[Mapping[str, float], Mapping[str, float]]] = {
    "wang2013": ({}, {}),
    "ggx+lambert": ({"ggx.alpha": 0.2, "ggx.F0": 0.5, "ggx.F90": 1.0, "lambert.rho": 0.4}, {"ggx.F90": 1.0}),
}
"""Models, the truth where it is not the default of their tables, and what is fixed."""

RANDOM, SYSTEMATIC = Correlation("random"), Correlation("systematic")


@dataclass(frozen=True)
class Coverage:
    """How often 1σ holds the truth for one parameter.

    Attributes
    ----------
    model, parameter : str
    carried, ignored : float
        Share of the scans whose p̂ ± σ holds the truth; with the correlations, and with the same total taken
        for independent.
    bar, bar_ignored, scatter : float
        Median claimed σ of both, and the standard deviation of the fitted values, as shares of the truth.
    scans : int
        Those where the parameter has a σ.
    """

    model: str
    parameter: str
    carried: float
    ignored: float
    bar: float
    bar_ignored: float
    scatter: float
    scans: int


@dataclass(frozen=True)
class MeanCheck:
    """The mean of a parameter over wavelengths: claimed and actual.

    Attributes
    ----------
    parameter : str
    wavelengths, scans : int
    claimed, independent, actual : float
        1σ of the mean with the covariances between wavelengths, without them, and the standard deviation of
        the means of the scans, as shares of the truth.
    """

    parameter: str
    wavelengths: int
    scans: int
    claimed: float
    independent: float
    actual: float


def directions() -> Directions:
    """Return 467 directions of a goniospectrometer in the plane of incidence, at six incident angles."""
    theta_i = (20.0, 30.0, 40.0, 50.0, 60.0, 70.0)
    theta_r = np.linspace(0.0, 77.0, 78)
    rows = np.array([(i, r) for i in theta_i for r in theta_r])[:-1]
    return Directions.relative(rows[:, 0], rows[:, 1], np.full(len(rows), 180.0))


def made_scan(model: Model, vector: Array, columns: Array, random: np.random.Generator, shared: bool) -> Scan:
    """Return a scan of one truth with errors; where `shared`, all columns have scale and angles in common."""
    where = directions()
    x = model.features(where)
    truth = model.brdf(vector[None, :], x)
    step = 1e-3
    ends = [
        model.brdf(
            vector[None, :],
            model.features(Directions.relative(where.theta_i + s, where.theta_r, np.full(len(where), 180.0))),
        )
        for s in (step, -step)
    ]
    slope = (ends[0] - ends[1]) / (2.0 * step)  # 1/sr per degree
    n, w = len(where), len(columns)
    size = 1 if shared else w
    _, angle = np.unique(where.theta_i, return_inverse=True)
    off = ANGLE * random.standard_normal((int(angle.max()) + 1, size))[angle.ravel()]
    scale = 1.0 + SCALE * random.standard_normal((1, size))
    values = (truth[:, None] + slope[:, None] * off) * scale
    values = values * (1.0 + NOISE * random.standard_normal((n, w)))
    over = SYSTEMATIC if shared else RANDOM
    components = (
        Component("noise", NOISE, True, RANDOM, SYSTEMATIC, RANDOM),
        Component("scale", SCALE, True, SYSTEMATIC, SYSTEMATIC, over),
        Component("incident angle", ANGLE * slope[:, None], False, SYSTEMATIC, RANDOM, over),
    )
    return Scan(
        where.theta_i, where.phi_i, where.theta_r, where.phi_r, columns, values, components=components
    )


def without_correlations(scan: Scan) -> Scan:
    """Return a scan with its total uncertainty, as if every error were one value's own."""
    return replace(scan, components=())


def coverage(
    name: str, scans: int = 500, seed: int = 0, device: Device | None = None, report: Report = silent
) -> list[Coverage]:
    """Return the coverage of 1σ for every fitted parameter of a model of CASES."""
    truth, fixed = CASES[name]
    model = get_model(name)
    vector = model.vector(truth)
    random = np.random.default_rng([seed, 0])
    columns = 400.0 + 0.5 * np.arange(scans, dtype=np.float64)
    scan = made_scan(model, vector, columns, random, shared=False)
    options: dict[str, Any] = {
        "model": model,
        "weights": "sigma",
        "fix": fixed,
        "device": device,
        "report": report,
    }
    carried, ignored = fit(scan, **options), fit(without_correlations(scan), **options)
    out = []
    for j, parameter in enumerate(model.names):
        if parameter in fixed:
            continue
        told = [_held(one, parameter, vector[j]) for one in (carried, ignored)]
        (share, bar), (other, other_bar) = told
        size = abs(float(vector[j]))
        good = np.isfinite(carried.sigma[parameter])
        scatter = float(np.std(carried.parameters[parameter][good])) / size
        out.append(
            Coverage(name, parameter, share, other, bar / size, other_bar / size, scatter, int(good.sum()))
        )
    return out


def _held(found: Fit, parameter: str, truth: float) -> tuple[float, float]:
    """Return the share of the columns whose 1σ holds the truth, and the median of σ."""
    sigma = found.sigma[parameter]
    good = np.isfinite(sigma)
    held = np.abs(found.parameters[parameter][good] - truth) <= sigma[good]
    return float(held.mean()), float(np.median(sigma[good]))


def mean_check(
    name: str = "wang2013",
    parameter: str = "kd",
    wavelengths: int = 77,
    scans: int = 100,
    seed: int = 0,
    device: Device | None = None,
    report: Report = silent,
) -> MeanCheck:
    """Return claimed and actual scatter of the mean of a parameter over wavelengths."""
    truth, fixed = CASES[name]
    model = get_model(name)
    vector = model.vector(truth)
    random = np.random.default_rng([seed, 1])
    columns = 380.0 + 5.0 * np.arange(wavelengths, dtype=np.float64)
    options: dict[str, Any] = {
        "model": model,
        "weights": "sigma",
        "fix": fixed,
        "device": device,
        "report": report,
    }
    made = [made_scan(model, vector, columns, random, shared=True) for _ in range(scans)]
    first = fit(made[0], **options)
    # All scans side by side: the optimum of a column does not depend on its neighbours.
    beside = replace(
        made[0],
        wavelength=380.0 + 0.05 * np.arange(wavelengths * scans, dtype=np.float64),
        brdf=np.concatenate([scan.brdf for scan in made], axis=1),
        sigma=None,
        flags=None,
        components=(made[0].components[0].columns(np.zeros(wavelengths * scans, dtype=np.intp)),),
    )
    means = fit(beside, **options).parameters[parameter].reshape(scans, wavelengths).mean(axis=1)
    size = abs(float(vector[model.names.index(parameter)]))
    independent = float(np.sqrt(np.mean(first.sigma[parameter] ** 2) / wavelengths))
    return MeanCheck(
        parameter,
        wavelengths,
        scans,
        first.mean(parameter).sigma / size,
        independent / size,
        float(np.std(means, ddof=1)) / size,
    )
