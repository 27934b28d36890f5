"""Reference optima of the problem set: the lower of two independent long fp64 runs, and where they are kept.

    clbrdf bench references --json FILE      makes them again (minutes)

They are kept in data/references.json with what made them. Both runs have to agree to AGREE, or none is kept.
"""

from __future__ import annotations

import json
import platform
from collections.abc import Mapping, Sequence
from importlib import metadata, resources
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.bench.problems import BenchProblem
from clbrdf.errors import ClbrdfError, InputError
from clbrdf.fit.given import given_parameters
from clbrdf.fit.problem import Problem, make_problem
from clbrdf.models import DEFAULT_MODEL, get_model
from clbrdf.objective import weight_matrix
from clbrdf.opencl.device import choose_device
from clbrdf.optimizers.gap import relative_gap
from clbrdf.optimizers.independent import search_twice
from clbrdf.optimizers.objective import NumpyObjective
from clbrdf.parallel.executor import Executor, Serial, run_jobs
from clbrdf.progress import Report, silent
from clbrdf.scan import Scan

Array = npt.NDArray[np.float64]

LONG = 4.0
"""Effort of the long runs, in budgets of a check."""

SEED = 2013

AGREE = 1e-9
"""Relative gap up to which the two runs agree: below the smallest target, 1e-8."""


def problem_of(scan: Scan, model: str = DEFAULT_MODEL, fix: Mapping[str, float] | None = None) -> Problem:
    """Return what optimizers are given of a scan: the limits of the table, weights of 1 as in the paper."""
    chosen = get_model(model)
    given = given_parameters(scan, chosen, fix or {})
    return make_problem(scan, weight_matrix(scan), chosen, chosen.bounds(), choose_device(), given)


def fingerprint(scan: Scan) -> float:
    """Return one number that tells whether a scan is the one searched: Σ f over usable values, 1/sr."""
    return float(np.where(scan.mask, 0.0, scan.brdf).sum())


def find_references(
    problems: Sequence[BenchProblem],
    *,
    effort: float = LONG,
    executor: Executor | None = None,
    report: Report = silent,
) -> dict[str, Any]:
    """Search the optima of some problems in two independent ways; return them as they are kept.

    Raises
    ------
    ClbrdfError
        The two runs do not agree: longer ones are needed.
    """
    whole = [problem_of(problem.scan, problem.model, problem.fix) for problem in problems]
    jobs = [(p, w, effort) for p in whole for w in range(p.size[0])]
    pairs = iter(run_jobs(executor or Serial(), _search, jobs, len(jobs), report))
    kept = {}
    for problem, p in zip(problems, whole, strict=True):
        found = [next(pairs) for _ in range(p.size[0])]
        first, second = (np.array([pair[k].objective for pair in found]) for k in (0, 1))
        lowest = np.minimum(first, second)
        apart = np.maximum(relative_gap(first, lowest), relative_gap(second, lowest))
        if (apart > AGREE).any():
            at = int(np.argmax(apart))
            raise ClbrdfError(
                f"{problem.name}, {problem.scan.wavelength[at]:g} nm: two searches of the reference end"
                f" {apart[at]:.1e} apart; give them more evaluations"
            )
        best = [
            complete(p, k, min(pair, key=lambda f: f.objective).coordinates) for k, pair in enumerate(found)
        ]
        kept[problem.name] = {
            "wavelength": problem.scan.wavelength.tolist(),
            "fingerprint": fingerprint(problem.scan),
            "objective": lowest.tolist(),
            "parameters": p.model.from_coordinates(np.array(best)).tolist(),
            "runs": [
                {
                    "optimizer": found[0][k].optimizer,
                    "evaluations": [pair[k].evaluations for pair in found],
                    "objective": E.tolist(),
                }
                for k, E in enumerate((first, second))
            ],
        }
    return {"provenance": _provenance(effort), "problems": kept}


def complete(problem: Problem, wavelength: int, free: Array) -> Array:
    """Return all coordinates (P,) of those that are free."""
    out: Array = problem.lower[wavelength].copy()
    out[list(problem.free)] = free
    return out


def _search(job: tuple[Problem, int, float]) -> Any:
    problem, wavelength, effort = job
    return search_twice(NumpyObjective(problem, wavelength), SEED + wavelength, effort)


def _provenance(effort: float) -> dict[str, str]:
    versions = {name: metadata.version(name) for name in ("clbrdf", "numpy", "scipy")}
    return {
        "made_by": "clbrdf bench references",
        "method": "lower of two runs in fp64: least-squares multi-start with analytic Jacobian; differential"
        " evolution with linear parameters solved inside; each refined by bounded least squares",
        "agreement": f"both within {AGREE:g} relative",
        "effort": f"{effort:g}",
        "seed": str(SEED),
        "python": platform.python_version(),
        **versions,
    }


def kept_references() -> Mapping[str, Mapping[str, Any]]:
    """Return the kept references by the name of the problem."""
    file = resources.files("clbrdf.bench").joinpath("data/references.json")
    problems: Mapping[str, Mapping[str, Any]] = json.loads(file.read_text(encoding="utf-8"))["problems"]
    return problems


def reference_of(problem: BenchProblem) -> Array:
    """Return the kept optimum E (W,) of a problem of the set.

    Raises
    ------
    InputError
        None is kept, or it belongs to other data.
    """
    kept = kept_references().get(problem.name)
    if kept is None or abs(kept["fingerprint"] / fingerprint(problem.scan) - 1.0) > 1e-9:
        raise InputError(
            f"no reference optimum is kept for problem {problem.name!r} as it is now;"
            " make them again with: clbrdf bench references"
        )
    return np.array(kept["objective"])
