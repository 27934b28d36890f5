"""`clbrdf bench optimizers` and `clbrdf bench references`: options, tables, words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from cyclopts import Parameter

from clbrdf.bench.comparison import (
    LONGEST,
    TARGETS,
    Rules,
    Task,
    able_methods,
    distinct_methods,
    run_methods,
    run_optimizers,
)
from clbrdf.bench.optimizers_figure import optimizers_figure
from clbrdf.bench.problems import BenchProblem, problem_set
from clbrdf.bench.profiles import Costs, costs_of, expected_running_time, success_rates
from clbrdf.bench.references import LONG, find_references, problem_of, reference_of
from clbrdf.bench.verdict import QUALITY, title, verdict
from clbrdf.cli.console import number, print_table, progress_bar, stdout_console
from clbrdf.cli.options import parameter_map
from clbrdf.errors import InputError
from clbrdf.fit import METHODS
from clbrdf.models import DEFAULT_MODEL, get_model
from clbrdf.opencl.device import Device
from clbrdf.optimizers import OPTIMIZERS
from clbrdf.parallel.executor import usable_cores
from clbrdf.parallel.processes import pool
from clbrdf.scan import Scan
from clbrdf.viz.curves import save_figure

QUICK = {"seeds": 15, "evaluations": 4000, "wavelengths": 1}
FULL = {"seeds": 15, "evaluations": 20_000, "wavelengths": 0}
"""0 means all."""

SCAN_EFFORT = LONG / 2.0
"""Of the two searches for the reference of a user's scan."""

NAMES = "names, joined by commas"


@dataclass(frozen=True)
class OptimizerOptions:
    """What `bench optimizers` takes; None where nothing was said."""

    problems: Annotated[str | None, Parameter(help=f"optimizers: problems of the set, {NAMES}, or none")] = (
        None
    )
    scan: Annotated[
        list[Path], Parameter(help="optimizers: a scan of your own, too", negative_iterable="")
    ] = field(default_factory=list)
    fix: Annotated[
        list[str],
        Parameter(help="optimizers with --scan: name=value of what is not fitted", negative_iterable=""),
    ] = field(default_factory=list)
    optimizers: Annotated[
        str | None, Parameter(help=f"optimizers: of others ({NAMES}), and methods of clbrdf fit")
    ] = None
    seeds: Annotated[int | None, Parameter(help="optimizers: runs of each, 15; choice, planner: 20")] = None
    evaluations: Annotated[int | None, Parameter(help="optimizers: budget of a run; 4000")] = None
    wavelengths: Annotated[int | None, Parameter(help="optimizers: of each problem; 1, and 0 for all")] = None
    objective: Annotated[
        str, Parameter(help="optimizers: numpy, opencl, or separable (linear parameters solved inside)")
    ] = "numpy"
    full: Annotated[
        bool,
        Parameter(
            help="optimizers: 20000 evaluations, all wavelengths; fit: chains at all sizes", negative=""
        ),
    ] = False


def check_unused(options: OptimizerOptions | None, what: str) -> None:
    """Raise InputError where options of `bench optimizers` are given to another benchmark."""
    for name, value in asdict(options or OptimizerOptions()).items():
        if value != asdict(OptimizerOptions())[name]:
            raise InputError(f"--{name}: bench {what} does not take it; it belongs to bench optimizers")


def bench_references() -> dict[str, Any]:
    """Search the reference optima of the problem set again; print and return them."""
    with progress_bar("reference optima") as report, pool(usable_cores()) as executor:
        content = find_references(problem_set(), executor=executor, report=report)
    rows = [
        [name, f"{wavelength:g}", number(E, 10), f"{abs(first - second) / max(E, 1e-300):.1e}"]
        for name, kept in content["problems"].items()
        for wavelength, E, first, second in zip(
            kept["wavelength"], kept["objective"], *(run["objective"] for run in kept["runs"]), strict=True
        )
    ]
    print_table("Reference optima", ("problem", "λ (nm)", "E", "two searches differ by"), rows)
    return content


def bench_optimizers(
    options: OptimizerOptions, device: Device, png: Path | None, overwrite: bool, model: str = DEFAULT_MODEL
) -> dict[str, Any]:
    """Compare optimizers; print tables and a paragraph, draw the figure, return all numbers."""
    size = {**(FULL if options.full else QUICK)}
    given = {name: getattr(options, name) for name in size}
    size.update({name: value for name, value in given.items() if value is not None})
    if size["wavelengths"] < 0:
        raise InputError(f"--wavelengths {size['wavelengths']}: give 1 or more, or 0 for all")
    names = _names(options.optimizers, "--optimizers", (*OPTIMIZERS, *METHODS))
    for name in names if options.optimizers is not None and options.objective == "separable" else ():
        if name in OPTIMIZERS and OPTIMIZERS[name].gradient:
            raise InputError(f"--optimizers: {name} uses derivatives, and --objective separable has none")
    rules = Rules(
        optimizers=tuple(n for n in names if n in OPTIMIZERS),
        methods=tuple(n for n in names if n in METHODS),
        seeds=size["seeds"],
        evaluations=size["evaluations"],
        objective=options.objective,
    )
    tasks = _tasks(options, size["wavelengths"], model)
    if options.optimizers is None:
        able = able_methods(tasks, rules.methods)
        rules = replace(rules, methods=distinct_methods(tasks, device, able))
    with progress_bar("optimizers") as report, pool(usable_cores()) as executor:
        runs = run_optimizers(tasks, rules, executor, report)
    with progress_bar("methods of clbrdf") as report:
        runs += run_methods(tasks, rules, device, report)
    table = [costs_of(runs, name) for name in dict.fromkeys(run.contender for run in runs)]
    said = (
        f"{sum(len(task.reference) for task in tasks)} wavelengths, {rules.seeds} seeds,"
        f" {rules.evaluations} evaluations a run, {rules.objective}"
    )
    print(f"{said}; {device}\n")
    _print_contenders(table)
    _print_problems(tasks, table)
    words = verdict(table, rules.evaluations)
    fitted = " or ".join(str(n) for n in sorted({len(task.reference) for task in tasks}))
    stdout_console().print(words + "\n")
    stdout_console().print(
        "ERT: evaluations, or seconds, of all runs over the number of successes; ∞ where there is none. A"
        " value with its gradient counts as two. Optimizers run on one core each, several at a time, at most"
        f" {LONGEST:g} s a run. Methods of clbrdf set their own budget and fit the wavelengths of a problem"
        f" at once on the whole device, here {fitted}; a fit costs the same whatever the target, and many"
        " at once cost less each."
    )
    if png is not None:
        counts = {problem_of(t.problem.scan, t.problem.model, t.problem.fix).free for t in tasks}
        save_figure(optimizers_figure(table, max(len(free) for free in counts), said), png, overwrite)
    return _content(rules, tasks, table, words)


def _names(text: str | None, option: str, known: Sequence[str]) -> tuple[str, ...]:
    if text is None:
        return tuple(known)
    names = tuple(dict.fromkeys(word.strip() for word in text.split(",")))
    for name in names:
        if name not in known:
            raise InputError(f"{option}: nothing is called {name!r}; there are {', '.join(known)}")
    return names


def _tasks(options: OptimizerOptions, wavelengths: int, model: str) -> list[Task]:
    """Return problems of the set and scans of the user's, with their references."""
    known = tuple(problem.name for problem in problem_set())
    chosen = () if options.problems == "none" else _names(options.problems, "--problems", known)
    tasks = []
    for problem in problem_set(chosen) if chosen else ():
        reference = reference_of(problem)
        places = _spread(np.arange(len(reference)), wavelengths)
        some = replace(problem, scan=problem.scan.columns(places))
        tasks.append(Task(some, reference[places]))
    scans: list[BenchProblem] = []
    if not options.scan and (model != DEFAULT_MODEL or options.fix):
        raise InputError("--model and --fix are of scans of your own here; add --scan FILE")
    fixed = get_model(model).by_full_name(parameter_map(options.fix, "--fix"))
    for path in options.scan:
        if any(scan.name == f"{path.stem} (scan)" for scan in scans):
            raise InputError(f"{path}: another scan of this command is called {path.stem}, too; rename one")
        scan = Scan.open(path)
        usable = np.flatnonzero((~scan.mask).any(axis=0))
        if len(usable) == 0:
            raise InputError(f"{path}: nothing to fit: all values are masked")
        name = f"{path.stem} (scan)"
        part = scan.columns(_spread(usable, wavelengths))
        scans.append(BenchProblem(name, "a scan of yours", part, model, fixed))
    if scans:
        bar = progress_bar("reference optima of your scans")
        with bar as report, pool(usable_cores()) as executor:
            found = find_references(scans, effort=SCAN_EFFORT, executor=executor, report=report)
        tasks += [Task(scan, np.array(found["problems"][scan.name]["objective"])) for scan in scans]
    if not tasks:
        raise InputError("--problems none leaves nothing to run; add --scan FILE")
    return tasks


def _spread(places: np.ndarray, count: int) -> np.ndarray:
    """Return `count` of the places, evenly; the middle one for 1, all for 0."""
    if count == 0 or count >= len(places):
        return places
    if count == 1:
        return places[[len(places) // 2]]
    return places[np.linspace(0, len(places) - 1, count).round().astype(np.intp)]


SHOWN = (1e-1, 1e-3, 1e-6, 1e-8)


def _print_contenders(table: Sequence[Costs]) -> None:
    shown = [TARGETS.index(target) for target in SHOWN]
    at = TARGETS.index(QUALITY)
    rows = []

    def rank(costs: Costs) -> tuple[float, ...]:
        ends = -success_rates(costs)
        return (ends[at], expected_running_time(costs, "seconds")[at], *ends)

    for costs in sorted(table, key=rank):
        rates, ert = success_rates(costs), expected_running_time(costs, "evaluations")
        seconds = expected_running_time(costs, "seconds")[at]
        runs = costs.spent.size
        never = f"∞ 0/{runs}"
        rows.append(
            [
                title(costs.contender),
                *(f"{100.0 * np.floor(1000.0 * rates[k]) / 1000.0:.1f}" for k in shown),
                *(f"{ert[k]:.0f}" if np.isfinite(ert[k]) else never for k in (shown[1], shown[2])),
                f"{seconds:.2g}" if np.isfinite(seconds) else "∞",
                f"{np.median(costs.elapsed):.2g}",
            ]
        )
    columns = (
        "",
        *(f"≤{t:.0e}".replace("e-0", "e-") for t in SHOWN),
        "ERT 1e-3",
        "ERT 1e-6",
        "s 1e-6",
        "s/run",
    )
    print_table("Runs (%) within a gap, and expected cost to reach it", columns, rows)


def _print_problems(tasks: Sequence[Task], table: Sequence[Costs]) -> None:
    at = TARGETS.index(QUALITY)
    rows = []
    for task in tasks:
        solved, best, cheapest = 0, "–", np.inf
        ours: list[tuple[float, str]] = []
        for costs in table:
            some = costs.only(task.problem.name)
            rate, ert = success_rates(some)[at], expected_running_time(some, "seconds")[at]
            if costs.contender in METHODS:
                ours.append((float(rate), costs.contender))
            else:
                solved += rate >= 0.5
                if ert < cheapest:
                    best, cheapest = costs.contender, ert
        told = f"{cheapest:.2g}" if np.isfinite(cheapest) else "∞"
        worst = min(ours, default=(1.0, ""))
        missed = f"{worst[1]} {100.0 * worst[0]:.0f} %" if worst[0] < 1.0 else "all" if ours else "–"
        rows.append([task.problem.name, task.problem.hard, str(solved), best, told, missed])
    columns = ("problem", "what is hard", "solved by", "best", "s", "ours")
    print_table(
        f"By problem: optimizers within {QUALITY:g} in half of their runs, the fastest, and ours",
        columns,
        rows,
        2,
    )


def _content(rules: Rules, tasks: Sequence[Task], table: Sequence[Costs], words: str) -> dict[str, Any]:
    """Return everything as plain values for JSON; infinite costs become null there."""
    return {
        "rules": asdict(rules),
        "targets": list(TARGETS),
        "quality": QUALITY,
        "words": words,
        "problems": [
            {
                "name": task.problem.name,
                "hard": task.problem.hard,
                "wavelength": task.problem.scan.wavelength.tolist(),
                "reference": task.reference.tolist(),
            }
            for task in tasks
        ],
        "contenders": [
            {
                "name": costs.contender,
                "success": success_rates(costs).tolist(),
                "ert_evaluations": expected_running_time(costs, "evaluations").tolist(),
                "ert_seconds": expected_running_time(costs, "seconds").tolist(),
                "problems": costs.problems.tolist(),
                "wavelength": costs.wavelengths.tolist(),
                "evaluations": costs.evaluations.tolist(),
                "seconds": costs.seconds.tolist(),
                "spent": costs.spent.tolist(),
                "elapsed": costs.elapsed.tolist(),
            }
            for costs in table
        ],
    }
