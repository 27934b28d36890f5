"""Optimizers of others and our own methods on the same problems, from many seeds, with the same targets.

The optimizers run one in a process, to a budget of evaluations a wavelength, and stop at the hardest target.
Our methods fit all wavelengths of a problem at once, as users call them, and tell only where they end: their
cost of a target is that of the whole fit, divided by the wavelengths.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.bench.problems import BenchProblem
from clbrdf.bench.references import problem_of
from clbrdf.errors import InputError
from clbrdf.fit import METHODS, Fit, fit
from clbrdf.fit.methods import get_method
from clbrdf.fit.problem import Problem
from clbrdf.models import get_model
from clbrdf.opencl.device import Device
from clbrdf.optimizers import OPTIMIZERS, minimise
from clbrdf.optimizers.device_objective import DeviceObjective
from clbrdf.optimizers.gap import relative_gap, target_value
from clbrdf.optimizers.objective import NumpyObjective, Values
from clbrdf.optimizers.separable import SeparableObjective
from clbrdf.parallel.executor import Executor, Serial, run_jobs
from clbrdf.progress import Report, silent

Array = npt.NDArray[np.float64]

TARGETS = tuple(10.0**-k for k in range(1, 9))
"""Relative gaps to the reference optimum."""

OBJECTIVES: dict[str, Callable[[Problem], Values]] = {
    "numpy": NumpyObjective,
    "opencl": DeviceObjective,
    "separable": lambda problem: SeparableObjective(NumpyObjective(problem)),
}
"""What optimizers call: E in NumPy, in OpenCL, or in NumPy with the linear parameters solved inside, where
only optimizers without derivatives run, over the coordinates that are left."""

LONGEST = 5.0
"""Seconds of one run, at most. Only shgo comes near: it spends most of its time beside the objective."""


@dataclass(frozen=True)
class Rules:
    """How much to run.

    Attributes
    ----------
    optimizers, methods : tuple of str
        Names in OPTIMIZERS, and in METHODS.
    seeds : int
        Runs of each that draws random numbers, on each wavelength.
    evaluations : int
        Budget of a run; a value with its gradient counts as two.
    objective : str
        One of OBJECTIVES.

    Raises
    ------
    InputError
        An unknown name, or a number out of range.
    """

    optimizers: tuple[str, ...] = tuple(OPTIMIZERS)
    methods: tuple[str, ...] = METHODS
    seeds: int = 15
    evaluations: int = 4000
    objective: str = "numpy"

    def __post_init__(self) -> None:
        for name in self.optimizers:
            if name not in OPTIMIZERS:
                raise InputError(f"no optimizer is called {name!r}; there are {', '.join(OPTIMIZERS)}")
        for name in self.methods:
            if name not in METHODS:
                raise InputError(f"no method is called {name!r}; there are {', '.join(METHODS)}")
        if self.objective not in OBJECTIVES:
            raise InputError(f"no objective is called {self.objective!r}; there are {', '.join(OBJECTIVES)}")
        for name in ("seeds", "evaluations"):
            if not 1 <= getattr(self, name) <= 10_000_000:
                raise InputError(f"{name} is {getattr(self, name)}; give 1 to 10000000")


@dataclass(frozen=True)
class OptimizerRun:
    """One contender on one wavelength from one seed.

    Attributes
    ----------
    contender : str
    problem : str
    wavelength : float
        nm.
    seed : int
    evaluations, seconds : tuple of float
        Cost of each of TARGETS; infinite where it was not reached.
    gap : float
        At the end.
    spent, elapsed : float
        Evaluations and seconds in all.
    """

    contender: str
    problem: str
    wavelength: float
    seed: int
    evaluations: tuple[float, ...]
    seconds: tuple[float, ...]
    gap: float
    spent: float
    elapsed: float


@dataclass(frozen=True, eq=False)
class Task:
    """A problem with its reference optima E (W,)."""

    problem: BenchProblem
    reference: Array


Job = tuple[str, Problem, str, float, int, int, str]


def run_optimizers(
    tasks: Sequence[Task], rules: Rules, executor: Executor | None = None, report: Report = silent
) -> list[OptimizerRun]:
    """Return a run of each optimizer on each wavelength from each seed."""
    jobs: list[Job] = []
    # The longest first, so that no process is left with one at the end.
    able = [n for n in rules.optimizers if rules.objective != "separable" or not OPTIMIZERS[n].gradient]
    for name in sorted(able, key=lambda n: n != "shgo"):
        seeds = rules.seeds if OPTIMIZERS[name].random else 1
        for task in tasks:
            for w, reference in enumerate(task.reference):
                one = problem_of(task.problem.scan.columns([w]), task.problem.model, task.problem.fix)
                jobs += [
                    (name, one, task.problem.name, reference, seed, rules.evaluations, rules.objective)
                    for seed in range(seeds)
                ]
    order = {name: k for k, name in enumerate(rules.optimizers)}
    runs = run_jobs(executor or Serial(), _run, jobs, len(jobs), report)
    return sorted(runs, key=lambda run: order[run.contender])


def _run(job: Job) -> OptimizerRun:
    name, problem, label, reference, seed, evaluations, kind = job
    objective = OBJECTIVES[kind](problem)
    aims = [target_value(reference, target) for target in TARGETS]
    trace = minimise(name, objective, evaluations=evaluations, seed=seed, target=aims[-1], seconds=LONGEST)
    costs = [trace.cost_to(aim) for aim in aims]
    return OptimizerRun(
        contender=name,
        problem=label,
        wavelength=float(problem.keys[0]) / 1000.0,
        seed=seed,
        evaluations=tuple(cost[0] for cost in costs),
        seconds=tuple(cost[1] for cost in costs),
        gap=float(relative_gap(trace.best, reference)),
        spent=float(trace.spent),
        elapsed=trace.elapsed,
    )


def run_methods(
    tasks: Sequence[Task], rules: Rules, device: Device, report: Report = silent
) -> list[OptimizerRun]:
    """Return a run of each of our methods on each wavelength from each seed."""
    runs, total, done = [], len(rules.methods) * len(tasks) * rules.seeds, 0
    for method in rules.methods:
        if tasks:
            _fit(tasks[0].problem, method, device)  # compiles, and does not count
        for task in tasks:
            for seed in range(rules.seeds):
                runs += fit_runs(task, method, seed, device)
                done += 1
                report(done, total)
    return runs


def fit_runs(task: Task, method: str, seed: int, device: Device) -> list[OptimizerRun]:
    """Return what one fit of a problem comes to, a run for each wavelength."""
    result = _fit(task.problem, method, device, seed)
    gaps = relative_gap(result.objective, task.reference)
    seconds = result.search.seconds / len(gaps)
    runs = []
    for wavelength, gap, spent in zip(result.wavelength, gaps, result.search.evaluations, strict=True):
        reached = [gap <= target for target in TARGETS]
        runs.append(
            OptimizerRun(
                contender=method,
                problem=task.problem.name,
                wavelength=float(wavelength),
                seed=seed,
                evaluations=tuple(float(spent) if hit else float("inf") for hit in reached),
                seconds=tuple(seconds if hit else float("inf") for hit in reached),
                gap=float(gap),
                spent=float(spent),
                elapsed=seconds,
            )
        )
    return runs


def _fit(problem: BenchProblem, method: str, device: Device, seed: int = 0) -> Fit:
    return fit(
        problem.scan, method=method, seed=seed, device=device, model=problem.model, fix=problem.fix or None
    )


def able_methods(tasks: Sequence[Task], methods: Sequence[str]) -> tuple[str, ...]:
    """Return the methods that work for the models of all tasks."""
    able = []
    for name in methods:
        try:
            for task in tasks:
                get_method(name, get_model(task.problem.model), None, tuple(task.problem.fix))
        except InputError:
            continue
        able.append(name)
    return tuple(able)


def distinct_methods(
    tasks: Sequence[Task], device: Device, methods: Sequence[str] = METHODS
) -> tuple[str, ...]:
    """Return the methods without `auto` where that is one of the others on every problem."""
    if "auto" not in methods or len(methods) == 1:
        return tuple(methods)
    taken = {_fit(task.problem, "auto", device).setup.method for task in tasks}
    if len(taken) == 1 and taken <= set(methods) - {"auto"}:
        return tuple(method for method in methods if method != "auto")
    return tuple(methods)
