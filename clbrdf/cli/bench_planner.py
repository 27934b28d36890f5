"""`clbrdf bench planner`: adaptive plans beside uniform ones."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from clbrdf.bench.emulated_plans import measure_plans_on_rigs
from clbrdf.bench.planner import SURFACES, TARGETS, PlanRun, measure_plans, sample_rig
from clbrdf.cli.console import print_table, progress_bar
from clbrdf.errors import InputError
from clbrdf.parallel.ending import scratch_folder
from clbrdf.parallel.executor import usable_cores
from clbrdf.parallel.processes import Processes

SEEDS = 20
"""Repetitions of every plan, each with noise of its own."""


PLANS_A_CORE = 6
"""A plan on the emulated rig mostly waits for bytes and stages."""


def bench_planner(seeds: int | None = None, emulated: bool = False) -> dict[str, Any]:
    """Run the plans with some seeds, 20 if not given; print a table, return all numbers.

    In simulated light, or on emulated rigs, point by point: some 40 minutes of two cores for 20 seeds.

    Raises
    ------
    InputError
        Fewer seeds than 1.
    """
    count = SEEDS if seeds is None else seeds
    if count < 1:
        raise InputError(f"--seeds {count}: give 1 or more")
    with progress_bar("plans") as report:
        if emulated:
            # The folder goes after the processes, which a signal may end amid their files.
            with scratch_folder() as folder, Processes(PLANS_A_CORE * usable_cores()) as pool:
                runs = measure_plans_on_rigs(count, folder, pool, report)
        else:
            runs = measure_plans(sample_rig(), count, report)
    rows = [
        row
        for surface in SURFACES
        for target in TARGETS
        for way in ("uniform", "adaptive")
        if (
            row := _row(
                [r for r in runs if (r.surface, r.target, r.way) == (surface.name, target, way)], emulated
            )
        )
    ]
    heads = ["surface", "plan", "target", "points", "seconds", "z", "rms z", "chi²"]
    where = "simulated light"
    if emulated:
        heads, where = [*heads, "reached"], "emulated rigs"
    print_table(f"Median and [5 %, 95 %] of {count} seeds, {where}", heads, rows, left=2)
    return {"planner": [asdict(run) for run in runs]}


def _row(runs: list[PlanRun], emulated: bool) -> list[str]:
    if not runs:
        return []
    reached = [run for run in runs if run.points]
    first = runs[0]
    head = [first.surface, first.way, f"{first.target:.2%}"]
    if not reached:
        return [*head, "not reached", *[""] * (5 if emulated else 4)]
    z = np.array([run.z for run in reached])
    known = bool(np.isfinite(z).all())
    chi2 = np.array([run.chi2 for run in reached])
    row = [
        *head,
        _band([float(run.points) for run in reached]),
        _band([run.seconds for run in reached]),
        f"{z.mean():.2f}" if known else "",
        f"{np.sqrt(np.mean(z**2)):.2f}" if known else "",
        f"{np.median(chi2):.2g}" if np.isfinite(chi2).all() else "",
    ]
    return [*row, f"{np.median([run.reached for run in reached]):.2%}"] if emulated else row


def _band(values: list[float]) -> str:
    low, middle, high = np.quantile(values, [0.05, 0.5, 0.95])
    return f"{middle:.0f} [{low:.0f}, {high:.0f}]"
