"""Fitting a model to a scan at every wavelength: one method a file."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, SupportsIndex, cast

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.fit.anneal import AnnealSettings
from clbrdf.fit.assemble import assemble
from clbrdf.fit.blocks import wavelength_blocks
from clbrdf.fit.dictionary import DictionarySettings
from clbrdf.fit.given import given_parameters
from clbrdf.fit.gls import generalised
from clbrdf.fit.intervals import with_intervals
from clbrdf.fit.jobs import Job, Jobs, solve_job
from clbrdf.fit.layout import Layout, layout_of
from clbrdf.fit.lookup import LookupSettings
from clbrdf.fit.methods import METHOD_NAMES, get_method
from clbrdf.fit.montecarlo import check_draws
from clbrdf.fit.montecarlo import monte_carlo as propagate
from clbrdf.fit.problem import Problem, make_problem
from clbrdf.fit.records import STATUSES, Search, Setup
from clbrdf.fit.requests import check_number, check_range, check_together, reflection_of, whole_seed
from clbrdf.fit.result import Fit
from clbrdf.fit.shared import follow_shared, shared_names, solve_shared
from clbrdf.fit.smooth import LEAST_CHANGE, start_each_other
from clbrdf.fit.smooth import smooth as smooth_out
from clbrdf.fit.solve import Solution, follow, joined, solve
from clbrdf.fit.summary import summarise_scan
from clbrdf.fit.tempering import TemperingSettings
from clbrdf.fit.through import SCAN, check_through, instrument_behind, look_through
from clbrdf.fit.tolerance import BEST, SAMPLE, Rung, choose_settings
from clbrdf.models import DEFAULT_MODEL, Model, Page, get_model
from clbrdf.objective import unweighted, weight_matrix
from clbrdf.observation import Observation
from clbrdf.opencl.device import Device, usable_device
from clbrdf.parallel.executor import Executor, run_jobs
from clbrdf.progress import Report, silent
from clbrdf.scan import Scan

if TYPE_CHECKING:
    from clbrdf.instrument.settings import Instrument

__all__ = [
    "METHODS",
    "STATUSES",
    "AnnealSettings",
    "DictionarySettings",
    "Fit",
    "LookupSettings",
    "TemperingSettings",
    "fit",
]

METHODS = METHOD_NAMES
"""`auto` is the fastest that reaches the optimum: `dictionary` where the model has one, else `lookup`."""


def fit(
    scan: Scan,
    *,
    method: str = "auto",
    seed: SupportsIndex = 0,
    weights: str | npt.ArrayLike = "none",
    bounds: Mapping[str, tuple[float, float]] | None = None,
    model: str | Model | Page = DEFAULT_MODEL,
    fix: Mapping[str, npt.ArrayLike] | None = None,
    shared: Sequence[str] = (),
    smooth: float | None = None,
    through: str | Path | Instrument = SCAN,
    rtol: float | None = None,
    monte_carlo: int | None = None,
    gls: bool = False,
    profile: bool = False,
    settings: AnnealSettings | TemperingSettings | DictionarySettings | LookupSettings | None = None,
    device: Device | str | None = None,
    executor: Executor | None = None,
    report: Report = silent,
) -> Fit:
    """Fit a model to a scan at every wavelength.

    A method searches for starts; a bounded Levenberg–Marquardt polish in fp64 with analytic derivatives
    takes each to a stationary point; the lowest E wins.

    Parameters
    ----------
    scan : Scan
        N directions × W wavelengths. Directions of transmission are left out: models are of reflection.
    method : str
        One of METHODS.
    seed : int
        0 to 2⁶⁴ − 1. The same scan, settings, seed and device give the same result to the last bit.
    weights : "none", "relative", "sigma" or (N,) array
        g of (13): 1; 1/f²; 1/σ² of the scan; or one weight a direction.
    bounds : mapping of str to (float, float), optional
        Limits that replace those of the model's table.
    model : str, Model or Page
        A name, such as "ggx+minnaert" (`clbrdf.models.get_model`).
    fix : mapping of str to float or (W,) array, optional
        Parameters that are not fitted: one value, or one a wavelength. The wavelength itself, where a model
        needs it, is that of the scan.
    shared : sequence of str
        Parameters that are one number for all wavelengths: the joint optimum of Σ g r² over directions and
        wavelengths; `clbrdf.fit.shared` tells what each kind of weights then means. Error bars are those of
        the joint fit. Names here and in `fix` and `bounds` may be short, "alpha" for "ggx.alpha", where only
        one part of the model has them.
    smooth : float, optional
        Ties parameters of neighbouring wavelengths: the share of its range by which a coordinate is
        expected to change in 10 nm, 1e-4 to 1; see `clbrdf.fit.smooth`. E then is that of the smooth
        parameters, and uncertainties hold with the penalty. None: every wavelength for itself.
    through : str, Path or Instrument
        What stands between the surface and the values: a file (`clbrdf.instrument.settings`), an
        Instrument, "scan" for what the scan tells of its own, "point" to leave it out. The search
        is of points; the parameters are then polished on what the detector sees (`clbrdf.fit.through`).
    rtol : float, optional
        Largest excess of E over the optimum, relative, 1e-9 to 1: the cheapest of the method's searches is
        taken whose excess on a sample of the scan's wavelengths is a tenth of it; `search.rungs` of the fit
        tells which. An estimate: other wavelengths are not looked at.
    monte_carlo : int, optional
        Draws of what the values could have been, each fitted again from the optimum (JCGM 101): intervals
        that know of limits and curvature, `fit.monte_carlo`; see `clbrdf.fit.montecarlo`.
    gls : bool
        Let the correlations of the scan's uncertainty count as weights, too. This takes the model for exact:
        see `clbrdf.fit.gls` before you ask for it.
    profile : bool
        Find profile-likelihood intervals of the parameters (`clbrdf.fit.profile`), ``fit.intervals``. They
        hold where parameters are at their limits, too, where standard uncertainties are far too small.
    settings : AnnealSettings, TemperingSettings, DictionarySettings or LookupSettings, optional
        Length and care of the search, of the type that the method takes; with them "auto" is the method
        that takes them.
    device : Device or str, optional
        From `clbrdf.opencl.device.choose_device`, or part of its name; the preferred one if not given.
    executor : Executor, optional
        Whose `map` runs the blocks of wavelengths, such as a `clbrdf.parallel.processes.Processes`, any
        `concurrent.futures.Executor`, or that of a Dask client, ``client.get_executor()``; the result is
        the same to the last bit. This process, one block after the other, if not given; with `shared`, in
        any case.
    report : callable
        Called with (steps done, steps in all).

    Returns
    -------
    Fit

    Raises
    ------
    InputError
        Unknown method, model, weights or bounds; settings of another method; `smooth` out of range; a fixed
        or shared parameter that the model does not have, one that is both, or one that has to be fixed and
        is not; shared parameters together with `smooth` or `rtol`; `profile` together with any of these;
        an instrument without geometry, or one whose cones reach below the horizon;
        `monte_carlo` together with `shared` or `smooth`, or out of range; `gls` together with one of the
        three, with other weights than "sigma", or for a scan without both a random and a common part;
        nothing in the scan that can be fitted, or values beyond those of any surface.
    DeviceError
        No OpenCL device with fp64.
    """
    if not isinstance(scan, Scan):
        raise InputError(f"fit takes a Scan, not {type(scan).__name__}; open a file with clbrdf.Scan.open")
    scan, weights, left_out = reflection_of(scan, weights)
    whole = whole_seed(seed)
    if smooth is not None and scan.bands:
        raise InputError("smooth ties neighbouring wavelengths, and the scan has bands; leave it out")
    check_number("smooth", smooth, LEAST_CHANGE, 1.0)
    check_number("rtol", rtol, BEST, 1.0)
    check_through(through)
    start = time.perf_counter()
    chosen = get_model(model)
    given = given_parameters(scan, chosen, fix or {})
    in_common = shared_names(chosen, shared, tuple(given))
    check_draws(monte_carlo)
    check_together(
        weights, bool(in_common), smooth=smooth, rtol=rtol, monte_carlo=monte_carlo, gls=gls, profile=profile
    )
    way = get_method(method, chosen, settings, frozenset({*given, *in_common}))
    rules = settings or way.settings()
    if rtol is not None and settings is not None:
        raise InputError("settings and rtol both choose the search; give one of them")
    limits, g = chosen.bounds(bounds), weight_matrix(scan, weights)
    fitted = np.flatnonzero((g > 0.0).any(axis=0))
    if len(fitted) == 0:
        reasons = ", ".join(f"{name} {count}" for name, count in scan.flag_counts().items())
        if not scan.mask.all():
            counts = ", ".join(f"{count} {reason}" for reason, count in unweighted(scan, g).items())
            raise InputError(
                f"nothing to fit: no value has a weight ({counts}); give uncertainties above 0, or other"
                " weights"
            )
        raise InputError(f"nothing to fit: all {scan.brdf.size} values are masked ({reasons})")
    check_range(scan, g)
    behind = instrument_behind(scan, through, smooth is not None)
    where, layout = usable_device(device), layout_of(chosen, scan.directions)

    def problem_of(places: npt.NDArray[np.intp], seen: Layout = layout) -> Problem:
        return make_problem(scan, g, chosen, limits, where, given, layout=seen, places=places)

    rungs: tuple[Rung, ...] = ()
    sample = np.empty(0, dtype=np.intp)
    if rtol is not None:
        sample = fitted[np.linspace(0, len(fitted) - 1, min(SAMPLE, len(fitted))).round().astype(np.intp)]
        problem = problem_of(sample)
        rungs = choose_settings(problem, way, whole, rtol)
        rules = rungs[0].settings
    if in_common:
        places = tuple(chosen.names.index(name) for name in in_common)
        norm = (g[:, fitted] * np.where(g[:, fitted] > 0.0, scan.brdf[:, fitted], 0.0) ** 2).sum(axis=0)
        parts = [solve_shared(problem_of(fitted), places, norm, way, rules, whole, report)]
    else:
        blocks = wavelength_blocks(fitted, *rules.cost(len(scan.theta_i), len(limits)))
        if executor is None:
            parts = []
            for k, block in enumerate(blocks):
                parts.append(solve(problem_of(block), way, rules, whole, _part_of(report, k, len(blocks))))
        else:
            jobs = Jobs(blocks, lambda block: Job(problem_of(block), way, rules, whole))
            parts = run_jobs(executor, solve_job, jobs, len(blocks), report)
    solution, tied, slit = joined(parts), None, None
    if behind is not None:

        def polished(observation: Observation, found: Solution) -> Solution:
            seen = layout_of(chosen, scan.directions, observation)
            if in_common:
                return follow_shared(problem_of(fitted, seen), places, norm, found)
            return follow(lambda block: problem_of(fitted[block], seen), found)

        problem = problem_of(fitted)
        solution, behind = look_through(
            *(scan, chosen, g, fitted, behind, solution, problem.free, (problem.lower, problem.upper)),
            polished,
        )
        layout = layout_of(chosen, scan.directions, behind.observation(scan.directions))
        slit = behind.slit(scan.wavelength[fitted])
    seen_problem = partial(problem_of, seen=layout)
    if smooth is not None:
        problem = seen_problem(fitted)
        solution = start_each_other(problem, solution)
        solution, tied = smooth_out(problem, solution, scan.wavelength[fitted], smooth, slit)
    usual = None
    if gls:
        seen, problem = layout.seen.take(np.argsort(layout.order)), seen_problem(fitted)
        limit_pair = problem.lower, problem.upper
        solution, usual = generalised(seen, scan.columns(fitted), g[:, fitted], solution, *limit_pair)
    setup = Setup(
        weights=g,
        weighting=weights if isinstance(weights, str) else "user",
        bounds=limits,
        fixed=given,
        shared=in_common,
        smooth=smooth,
        rtol=rtol,
        left_out=left_out,
        method=way.name,
        seed=whole,
        gls=gls,
    )
    estimate, goodness, status = assemble(
        scan, layout, seen_problem, setup, solution, where, tied, slit, usual
    )
    drawn = None
    if monte_carlo is not None:
        drawn = propagate(
            seen_problem(fitted),
            scan.columns(fitted),
            g[:, fitted],
            estimate.vector[fitted],
            estimate.sigma[fitted],
            limits,
            monte_carlo,
            whole,
            report,
        ).placed(fitted, len(scan.wavelength))
    if profile:
        sums = summarise_scan(scan, g, layout, seen_problem, fitted, estimate.vector[fitted])
        estimate = with_intervals(seen_problem(fitted), sums, chosen, setup, estimate)
    return Fit(
        scan=scan,
        model=chosen,
        setup=setup,
        estimate=estimate,
        goodness=goodness,
        search=_search_of(setup, solution, str(where), rungs, len(sample), start),
        status=status,
        through=behind,
        provenance=_provenance(setup, rules),
        monte_carlo=drawn,
    )


def _search_of(
    setup: Setup, solution: Solution, device: str, rungs: tuple[Rung, ...], sample: int, start: float
) -> Search:
    """Return how a fit that began at `start` (`time.perf_counter`) was searched."""

    def placed(name: str) -> npt.NDArray[Any]:
        some = getattr(solution, name)
        out = np.full(setup.weights.shape[1], np.nan if some.dtype.kind == "f" else 0, dtype=some.dtype)
        out[setup.fitted] = some
        return out

    return Search(
        device=device,
        evaluations=placed("evaluations"),
        starts=placed("starts"),
        agreeing=placed("agreeing"),
        acceptance=placed("acceptance"),
        not_finite=placed("not_finite"),
        rungs=rungs,
        sample=sample,
        seconds=time.perf_counter() - start,
    )


def _provenance(setup: Setup, rules: object) -> dict[str, str]:
    """Return the settings of a fit in words, for readers of its file."""
    out = {"weights": setup.weighting}
    if setup.left_out:
        out["left_out"] = f"{setup.left_out} directions, those of transmission"
    out |= {f"{setup.method}_{name}": str(value) for name, value in asdict(cast(Any, rules)).items()}
    if setup.shared:
        out["shared"] = ", ".join(setup.shared)
    for name in ("rtol", "smooth"):
        if getattr(setup, name) is not None:
            out[name] = f"{getattr(setup, name):g}"
    return out


def _part_of(report: Report, part: int, parts: int) -> Report:
    """Return a report for one of several parts that tells of the whole, in thousandths of a part."""
    return lambda done, total: report(1000 * part + 1000 * done // total, 1000 * parts)
