"""Adaptive plans beside uniform ones on emulated rigs: drivers, bytes, shutter, darks and calibration.

What `planner.py` does in simulated light, a rig does here, point after point. Its time runs faster than ours,
and what the planner itself computes would count too much in it: the seconds are travel, exposures and
exchanges of the points that were measured, as there.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from clbrdf.bench.planner import (
    NOISE,
    SURFACES,
    TARGETS,
    WAVELENGTH,
    PlannedSurface,
    PlanRun,
    bench_plan,
    measure_uniform,
    rig_seconds,
    sample_rig,
    sample_rig_text,
)
from clbrdf.fit import fit
from clbrdf.parallel.executor import Executor, run_jobs
from clbrdf.progress import Report, silent
from clbrdf.rig.budget import POINTS_ONLY
from clbrdf.rig.emulator.rig import EmulatedRig
from clbrdf.rig.measure import measure
from clbrdf.rig.rawscan import read_raw
from clbrdf.rig.rigfile import load_rig
from clbrdf.rig.row import POINT
from clbrdf.rig.uncertainty import MEDIAN_OF_THREE
from clbrdf.scan import Scan

FACTOR = 20.0
"""Seconds of the rig in one of ours."""

LONG_SEEDS = 2
"""Seeds of the uniform plan on LONGEST to the finest target: some 2000 points, half an hour each."""

LONGEST = "wang2013"
"""See LONG_SEEDS."""


@dataclass(frozen=True)
class EmulatedPlan:
    """One plan to measure.

    Attributes
    ----------
    surface : PlannedSurface
    way : str
        "adaptive" or "uniform".
    target : float
        Relative, of the lobe's width.
    seed : int
        Of the rig's noise, and of where a uniform plan begins.
    """

    surface: PlannedSurface
    way: str
    target: float
    seed: int


def measure_on_rig(job: EmulatedPlan, scratch: Path) -> PlanRun:
    """Measure a plan on an emulated rig, calibrate it, and fit what it gives.

    A uniform plan takes as many points as that target took in simulated light with the same seed, where it
    had been searched; `reached` tells what they came to here. Files lie below `scratch` meanwhile.
    """
    surface = job.surface
    lost = PlanRun(surface.name, job.way, job.seed, job.target, 0, np.nan, np.nan, np.nan)
    count = 0
    if job.way == "uniform":
        runs = measure_uniform(surface, sample_rig(), job.seed)
        count = next(run.points for run in runs if run.target == job.target)
        if not count:
            return lost
    plan = bench_plan(surface, job.target).adaptive
    assert plan is not None
    with tempfile.TemporaryDirectory(dir=scratch) as name:
        folder = Path(name)
        (folder / "rig.toml").write_text(rig_text(surface, job.seed), encoding="utf-8")
        (folder / "plan.toml").write_text(plan_text(job, count), encoding="utf-8")
        rig = load_rig(folder / "rig.toml")
        with EmulatedRig(rig):
            outcome = measure(
                folder / "plan.toml", folder / "rig.toml", folder / "scan.h5", budget=POINTS_ONLY
            )
        scan, rows = Scan.open(folder / "scan.h5"), read_raw(folder / "scan.h5").rows
    if job.way == "adaptive" and outcome.points >= plan.points:
        return lost
    mine = rows["kind"] == POINT
    seconds = rig_seconds(rig, rows["axes"][mine], rows["integration_time"][mine])
    found = fit(scan, model=surface.fitted, weights="sigma", fix=plan.fix)
    value, sigma = float(found.parameters[surface.wanted][0]), float(found.sigma[surface.wanted][0])
    z = (value - surface.parameters[surface.wanted]) / sigma if surface.is_right else float("nan")
    return PlanRun(
        surface.name,
        job.way,
        job.seed,
        job.target,
        int(mine.sum()),
        seconds,
        z,
        float(found.chi2_reduced[0]),
        sigma / abs(value) / surface.power,
    )


def rig_text(surface: PlannedSurface, seed: int) -> str:
    """Return the sample rig file with a surface, and with readings of the lamp's power that differ.

    Two medians of three readings make the power of a point: so large is the noise of one.
    """
    reading = NOISE / 100.0 / np.sqrt(MEDIAN_OF_THREE / 2.0)
    kept, _, _ = sample_rig_text().partition("[emulator]")
    lines = [line for line in kept.splitlines() if not line.startswith(("noise =", "band ="))]
    place = lines.index(next(line for line in lines if line.startswith("[reference]"))) + 1
    # The band has room for the noise: no point waits for the lamp.
    lines[place:place] = [f"noise = {reading:.6g}", "band = 0.25"]
    values = ", ".join(f"{json.dumps(name)} = {value!r}" for name, value in surface.parameters.items())
    return "\n".join(
        [
            *lines,
            "[emulator]",
            f"model = {json.dumps(surface.model)}",
            f"parameters = {{ {values} }}",
            f"time_factor = {FACTOR:g}",
            f"seed = {seed}",
            "[emulator.effects]",
            "shot_noise = true",
            "read_noise = 3.0",
            f"reference_noise = {reading:.6g}",
            "",
        ]
    )


def plan_text(job: EmulatedPlan, count: int) -> str:
    """Return a plan file: adaptive among the views of `bench_plan`, or `count` views evenly spread."""
    plan = bench_plan(job.surface, job.target)
    assert plan.adaptive is not None
    (nm,) = WAVELENGTH
    lines = [f"theta_i = {list(plan.theta_i)}", f"wavelength = {{ start = {nm}, stop = {nm}, step = 5 }}"]
    if job.way == "uniform":
        # As many on each side of the normal.
        each = max(1, round(count / (2 * len(plan.theta_i))))
        step = max(plan.theta_r) / each
        first = np.random.default_rng([job.seed, 2]).uniform() * step
        return "\n".join([*lines, f"theta_r = {[round(first + k * step, 6) for k in range(each)]}", ""])
    adaptive = plan.adaptive
    fix = ", ".join(f"{json.dumps(name)} = {value!r}" for name, value in adaptive.fix.items())
    return "\n".join(
        [
            *lines,
            f"theta_r = {list(plan.theta_r)}",
            "[adaptive]",
            f"model = {json.dumps(adaptive.model)}",
            f"parameters = {json.dumps(list(adaptive.parameters))}",
            f"sigma = {adaptive.sigma!r}",
            f"wavelengths = {adaptive.wavelengths}",
            f"fix = {{ {fix} }}",
            "",
        ]
    )


def emulated_plans(seeds: int) -> Iterator[EmulatedPlan]:
    """Every surface both ways to both targets, the long plans first, then seed after seed."""
    long = next(surface for surface in SURFACES if surface.name == LONGEST)
    for seed in range(min(seeds, LONG_SEEDS)):
        yield EmulatedPlan(long, "uniform", TARGETS[-1], seed)
    for seed in range(seeds):
        for surface in SURFACES:
            for target in TARGETS:
                for way in ("uniform", "adaptive"):
                    if (surface.name, way, target) != (LONGEST, "uniform", TARGETS[-1]):
                        yield EmulatedPlan(surface, way, target, seed)


def measure_plans_on_rigs(
    seeds: int, scratch: Path, executor: Executor, report: Report = silent
) -> list[PlanRun]:
    """Measure every plan, each on a rig of its own, in a folder that outlives the executor's processes."""
    jobs = list(emulated_plans(seeds))
    return run_jobs(executor, partial(measure_on_rig, scratch=scratch), jobs, len(jobs), report)
