"""Work-precision tables: what each digit costs, for values, objectives, fits and integrals."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.bench.hard_cases import HARD_CASES, TIN_FOIL
from clbrdf.bench.workload import median_seconds, workload
from clbrdf.evaluate import evaluate_reference
from clbrdf.fit.anneal import AnnealSettings
from clbrdf.fit.dictionary import DictionarySettings
from clbrdf.fit.methods import METHODS
from clbrdf.fit.objectives import batch_objective, prepare_objective
from clbrdf.fit.problem import Problem, make_problem
from clbrdf.fit.solve import Solution, solve
from clbrdf.geometry import Directions
from clbrdf.models import get_model
from clbrdf.objective import weight_matrix
from clbrdf.opencl.device import Device
from clbrdf.opencl.precision import PRECISIONS, Precision, get_precision
from clbrdf.opencl.values import evaluate_directions
from clbrdf.progress import Report, silent
from clbrdf.reflectance import HemisphereGrid, graded_grid, uniform_grid
from clbrdf.scan import Scan

Array = npt.NDArray[np.float64]

SMALLEST = 1e-30
"""Values below are not compared: single precision has no numbers for them."""


@dataclass(frozen=True)
class AccuracyPoint:
    """One point of a work-precision table.

    Attributes
    ----------
    series, name : str
        Which curve, and what was done.
    seconds : float
        For one evaluation (a, b), one wavelength (c) or one integral (d).
    error : float
        Largest relative error (a, b, d), or median relative excess of E (c).
    note : str
    """

    series: str
    name: str
    seconds: float
    error: float
    note: str = ""


@dataclass(frozen=True)
class CostPanel:
    """One table: title, what the axes mean, its points."""

    title: str
    work: str
    error: str
    points: tuple[AccuracyPoint, ...]


def precisions_of(device: Device) -> list[Precision]:
    """Return the precisions that a device computes in."""
    return [p for p in PRECISIONS.values() if p.dtype is np.float32 or device.has_double]


def value_panel(device: Device) -> CostPanel:
    """Measure (a): error of model values against 60 digits, over the time for one of many values."""
    model, points = get_model(), []
    easy_angles = np.arange(0.0, 81.0, 2.0)
    easy = Directions.relative(np.repeat([30.0, 45.0, 60.0], 41), np.tile(easy_angles, 3), np.full(1, 180.0))
    families = {
        "easy": [(model.vector(TIN_FOIL)[None], easy)],
        "hard": [
            (np.stack([model.vector(p) for p in case.parameter_sets()]), Directions.relative(*case.angles()))
            for case in HARD_CASES
        ],
    }
    exact = {name: [evaluate_reference(model, *work) for work in works] for name, works in families.items()}
    rng = np.random.default_rng(3)
    many = Directions.relative(
        rng.uniform(0, 80, 1 << 14), rng.uniform(0, 80, 1 << 14), rng.uniform(0, 360, 1 << 14)
    )
    sets = np.repeat(model.defaults[None], 64, axis=0)
    for p in precisions_of(device):
        seconds = median_seconds(partial(evaluate_directions, model, sets, many, p, device), 5)
        for name, works in families.items():
            errors = [
                relative_error(evaluate_directions(model, *work, p, device), reference)
                for work, reference in zip(works, exact[name], strict=True)
            ]
            points.append(AccuracyPoint(name, p.name, seconds / (len(many) * len(sets)), max(errors)))
    return CostPanel("(a) model values", "seconds a value", "largest relative error", tuple(points))


def relative_error(values: Array, reference: Array) -> float:
    """Return the largest relative error where the reference is above SMALLEST."""
    counted = reference > SMALLEST
    return float(np.max(np.abs(values[counted] / reference[counted] - 1.0), initial=0.0))


def objective_panel(device: Device) -> CostPanel:
    """Measure (b): error of E against 60 digits, over the time for one model evaluation in it."""
    problem, sets = workload(device)
    few = sets[:, :3]
    exact = exact_objective(problem, few[0])
    points = []
    for p in precisions_of(device):
        launch, _ = prepare_objective(problem, sets, p)
        seconds = median_seconds(launch) / (problem.size[1] * sets.shape[1])
        error = relative_error(batch_objective(problem, few, p)[0], exact)
        points.append(AccuracyPoint("E near the optimum", p.name, seconds, error))
    return CostPanel("(b) objective E", "seconds an evaluation", "largest relative error", tuple(points))


def exact_objective(problem: Problem, sets: Array) -> Array:
    """Return E (K,) of parameter sets (K, P) of the workload, summed in 60 digits."""
    import mpmath

    from clbrdf.bench.workload import workload_directions
    from clbrdf.evaluate import REFERENCE_DIGITS

    d = workload_directions()
    angles = list(zip(d.theta_i, d.phi_i, d.theta_r, d.phi_r, strict=True))
    with mpmath.workdps(REFERENCE_DIGITS):
        rows = list(zip(problem.scale[0].tolist(), problem.target[0].tolist(), angles, strict=True))
        squares = [[(s * problem.model.reference(p, *a) - t) ** 2 for s, t, a in rows] for p in sets]
        return np.array([float(mpmath.fsum(terms)) for terms in squares])


FIT_SIZES = ((8, 5), (16, 8), (32, 15), (64, 30))
FIT_SETTINGS = tuple((*size, name) for name in ("fast:4", "single") for size in FIT_SIZES)


def fit_panel(device: Device, scan: Scan, report: Report = silent) -> CostPanel:
    """Measure (c): excess of E and error of the parameters over the time, for chains × steps × precision.

    Found is an excess below 1e-6; the error of the coordinates q is a share of their range, the median of
    the worst of each wavelength. Chains are judged alone and polished; the dictionary at every depth it has.
    The best known is the lowest E of all runs of this panel and of a longer one, its parameters are the
    right ones.
    """
    model = get_model()
    problem = make_problem(scan, weight_matrix(scan), model, model.bounds(), device)
    runs = []
    for k, (chains, levels, name) in enumerate(FIT_SETTINGS):
        settings = AnnealSettings(chains=chains, levels=levels, starts=max(1, chains // 8), precision=name)
        label = f"{chains} × {levels * settings.sweeps}"
        alone = replace(settings, starts=1, polish="none")
        runs.append((f"alone, {name}", label, *_timed(problem, "anneal", alone)))
        runs.append((f"polished, {name}", label, *_timed(problem, "anneal", settings)))
        report(k + 1, len(FIT_SETTINGS))
    for words, dictionary in (*METHODS["dictionary"].cheaper, ("two looks", DictionarySettings())):
        label = words.removeprefix("dictionary").strip(", ").replace("in single precision", "single")
        runs.append(("dictionary", label, *_timed(problem, "dictionary", dictionary)))
    long = solve(problem, METHODS["anneal"], AnnealSettings(chains=128, levels=40, starts=32), 1, silent)
    solutions = [long, *(run[3] for run in runs)]
    lowest = np.argmin([solution.objective for solution in solutions], axis=0)
    best = np.min([solution.objective for solution in solutions], axis=0)
    right = np.stack([solutions[s].coordinates[w] for w, s in enumerate(lowest)])
    points = []
    for series, label, seconds, solution in runs:
        excess = solution.objective / best - 1.0
        off = (np.abs(solution.coordinates - right) / (problem.upper - problem.lower)).max(axis=1)
        share = float(np.median(off))
        met = f"{100 * np.mean(excess < 1e-6):.0f} % found, q ± {share:.0e}"
        middle = float(np.median(np.maximum(excess, 1e-16)))
        points.append(AccuracyPoint(series, label, seconds / len(best), middle, met))
    return CostPanel("(c) fit: chains × sweeps", "seconds a wavelength", "median excess of E", tuple(points))


def _timed(problem: Problem, method: str, settings: Any) -> tuple[float, Solution]:
    """Return the seconds of a solution, and the solution; a first one compiles."""
    for _ in range(2):
        start = time.perf_counter()
        solution = solve(problem, METHODS[method], settings, 0, silent)
        seconds = time.perf_counter() - start
    return seconds, solution


BROAD = {**TIN_FOIL, "c": -10.0, "d": 1.0, "a": 0.0, "ks": 1.0, "kd": 0.1}
NARROW = {**BROAD, "c": -np.log(2.0) / (1.0 - np.cos(np.deg2rad(0.025))), "ks": 4e4}
"""A lobe 0.1° wide at half height (γ, half the angle from the mirror direction, is 0.025° there) that carries
a third of the light."""


def integral_panel(device: Device) -> CostPanel:
    """Measure (d): error of the reflectance to 85° at θi = 60° over the time, for growing grids."""
    model, double, points = get_model(), get_precision("double"), []

    def integrate(grid: HemisphereGrid, parameters: Array) -> float:
        directions = Directions.relative(np.full(1, 60.0), grid.theta_r, grid.phi)
        return float(grid.weight @ evaluate_directions(model, parameters, directions, double, device)[:, 0])

    def make_and_integrate(maker: Callable[[int], HemisphereGrid], n: int, parameters: Array) -> float:
        return integrate(maker(n), parameters)

    makers: dict[str, tuple[Callable[[int], HemisphereGrid], tuple[int, ...]]] = {
        "uniform": (lambda n: uniform_grid(85.0, n), (17, 34, 85, 170, 340, 850)),
        "graded": (lambda n: graded_grid(60.0, 85.0, n), (2, 3, 4, 6, 8, 12)),
    }
    for lobe, named in (("broad", BROAD), ("0.1°", NARROW)):
        parameters = model.vector(named)[None]
        exact = integrate(graded_grid(60.0, 85.0, 30), parameters)
        for kind, (maker, sizes) in makers.items():
            for n in sizes:
                grid = maker(n)
                seconds = median_seconds(partial(make_and_integrate, maker, n, parameters), 3)
                error = max(abs(integrate(grid, parameters) / exact - 1.0), 1e-16)
                points.append(
                    AccuracyPoint(f"{kind}, {lobe} lobe", f"{len(grid.weight)} directions", seconds, error)
                )
    return CostPanel("(d) reflectance to 85°", "seconds an integral", "relative error", tuple(points))


def some_wavelengths(scan: Scan, wavelengths: int) -> Scan:
    """Return a scan at some of its wavelengths, evenly chosen."""
    places = np.linspace(0, len(scan.wavelength) - 1, wavelengths).round().astype(np.intp)
    return replace(scan.columns(places), sample=scan.sample)
