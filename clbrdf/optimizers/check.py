"""Is a fit at the global optimum? Two independent optimizers search it again; a verdict per wavelength.

for verdict in check_fit(clbrdf.Fit.open("fit.h5")):
print(verdict.wavelength, verdict.word, verdict.gap)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.fit.problem import Problem, make_problem
from clbrdf.fit.result import Fit
from clbrdf.opencl.device import choose_device
from clbrdf.optimizers.gap import relative_gap
from clbrdf.optimizers.independent import SearchedOptimum, search_twice
from clbrdf.optimizers.objective import NumpyObjective
from clbrdf.parallel.executor import Executor, Serial, run_jobs
from clbrdf.progress import Report, silent

TOLERANCE = 1e-6
"""Relative gap in E up to which two ends agree. E above its minimum by 1/(N − P) of itself is one standard
deviation away from it: for N up to 10⁴ directions 1e-6 is at most a tenth of a standard uncertainty, and it
is far above rounding, 1e-13."""

WAVELENGTHS = 8
"""Looked at where nothing else is asked for."""

TIED = "a fit with smooth parameters gives up some of E on purpose: check it without smooth"

WORDS = ("agreed", "better", "worse")
"""agreed
    E of the fit and the lower E of the two searches are the same within the tolerance
better
    the fit is lower than both
worse
    a search found a lower E: the fit is not at the global optimum
"""


@dataclass(frozen=True)
class Verdict:
    """What the check says of one wavelength.

    Attributes
    ----------
    wavelength : float
        nm.
    word : str
        One of WORDS.
    gap : float
        (E − E_found) / E_found, E_found the lower one of the searches; relative to 1e-12 where that is
        smaller (clbrdf.optimizers.gap). Infinite where the fit has no finite E.
    objective : float
        E (13) of the fit, formed anew from its parameters.
    found : mapping of str to float
        E where each search ended, by the name of the optimizer.
    evaluations : int
        Of both searches.
    """

    wavelength: float
    word: str
    gap: float
    objective: float
    found: dict[str, float]
    evaluations: int


def tolerance_of(fit: Fit) -> float:
    """Return the gap in E up to which a fit agrees: the `rtol` that it was made with, else TOLERANCE."""
    return TOLERANCE if fit.setup.rtol is None else fit.setup.rtol


def sample_places(fit: Fit, count: int | None = WAVELENGTHS) -> npt.NDArray[np.intp]:
    """Return places of `count` wavelengths that have data, evenly over the range; of all, with None.

    Raises
    ------
    InputError
        A count below 1.
    """
    fitted = fit.setup.fitted
    if count is None or count >= len(fitted):
        return fitted
    if count < 1:
        raise InputError(f"{count} wavelengths to check; give 1 or more, or all")
    return fitted[np.linspace(0, len(fitted) - 1, count).round().astype(np.intp)]


def check_fit(
    fit: Fit,
    places: Sequence[int] | npt.NDArray[np.intp] | None = None,
    *,
    seed: int = 0,
    effort: float = 1.0,
    executor: Executor | None = None,
    report: Report = silent,
) -> tuple[Verdict, ...]:
    """Search the optimum of a fit again at some of its wavelengths.

    Parameters that the fit held, or that its wavelengths share, keep their values: the check is of the
    others.

    Parameters
    ----------
    fit : Fit
    places : sequence of int, optional
        Of the wavelengths; `sample_places(fit)` if not given. All have to have data.
    seed : int
        Of the searches.
    effort : float
        Factor on their budgets (clbrdf.optimizers.independent).
    executor : Executor, optional
        Runs the wavelengths; one after the other if not given. Results do not depend on it.
    report : callable
        Called with (wavelengths done, wavelengths in all).

    Returns
    -------
    tuple of Verdict
        In the order of `places`.

    Raises
    ------
    InputError
        A place that is not in the fit, or has no data; a fit whose wavelengths were tied (`smooth`), which
        gives up some of E on purpose.
    """
    if fit.setup.smooth is not None:
        raise InputError(TIED)
    chosen = sample_places(fit) if places is None else np.asarray(places, dtype=np.intp)
    w = len(fit.wavelength)
    for place in chosen:
        if not 0 <= place < w:
            raise InputError(f"no wavelength {place} to check; the fit has {w}, counted from 0")
        if not (fit.setup.weights[:, place] > 0.0).any():
            raise InputError(f"nothing to check at {fit.wavelength[place]:g} nm: all values are masked")
    jobs = []
    for place in chosen:
        one = [int(place)]
        problem = make_problem(
            *(fit.scan.columns(one), fit.setup.weights[:, one], fit.model, fit.setup.bounds, choose_device()),
            given={name: fit.parameters[name][one] for name in (*fit.given, *fit.shared)},
            observation=fit.observation,
        )
        jobs.append((problem, seed, effort))
    found = run_jobs(executor or Serial(), _search, jobs, len(jobs), report)
    return tuple(
        _verdict(fit, int(place), problem, pair)
        for place, (problem, _, _), pair in zip(chosen, jobs, found, strict=True)
    )


def _search(job: tuple[Problem, int, float]) -> tuple[SearchedOptimum, SearchedOptimum]:
    problem, seed, effort = job
    return search_twice(NumpyObjective(problem), seed, effort)


def _verdict(
    fit: Fit, place: int, problem: Problem, found: tuple[SearchedOptimum, SearchedOptimum]
) -> Verdict:
    E = NumpyObjective(problem).at_parameters(fit.vector[place])
    gap = float(relative_gap(E, min(f.objective for f in found)))
    tolerance = tolerance_of(fit)
    word = "worse" if not gap <= tolerance else "better" if gap < -tolerance else "agreed"
    return Verdict(
        wavelength=float(fit.wavelength[place]),
        word=word,
        gap=gap,
        objective=E,
        found={f.optimizer: f.objective for f in found},
        evaluations=sum(f.evaluations for f in found),
    )
