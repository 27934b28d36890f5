"""`clbrdf bench choice`: how often each rule finds the model that made the data."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from clbrdf.bench.choice import (
    CANDIDATES,
    NOISE,
    RULES,
    SEEDS,
    SYSTEMATIC,
    TRUTH,
    TrialOutcome,
    refusals,
    run,
    truths,
)
from clbrdf.cli.console import print_table, progress_bar, stdout_console
from clbrdf.errors import InputError
from clbrdf.opencl.device import Device


def bench_choice(device: Device, seeds: int | None = None) -> dict[str, Any]:
    """Choose on made scans, print how often each rule found the truth, return all outcomes.

    Raises
    ------
    InputError
        Fewer seeds than 1.
    """
    count = SEEDS if seeds is None else seeds
    if count < 1:
        raise InputError(f"--seeds {count}: give 1 or more")
    with progress_bar("made scans") as report:
        outcomes = run(device, range(count), report=report)
    print_outcomes(outcomes, count)
    return {"truth": TRUTH, "candidates": list(CANDIDATES), "outcomes": [asdict(o) for o in outcomes]}


def print_outcomes(outcomes: list[TrialOutcome], count: int) -> None:
    """Print a row for each rule, a column for each size of the systematic error."""
    rows = [[rule, *(str(truths(outcomes, size, rule)) for size in SYSTEMATIC)] for rule in RULES]
    rows.append(["choose says that no model fits", *(str(refusals(outcomes, s)) for s in SYSTEMATIC)])
    heads = ("", *(f"{100 * size:g} %" for size in SYSTEMATIC))
    print_table(f"Truth chosen, times of {count}", heads, rows)
    stdout_console().print(
        f"Truth {TRUTH}, candidates {', '.join(CANDIDATES)}; noise {100 * NOISE:g} %, of which scans know."
        " Columns: systematic error, a smooth factor over θi and θr that no model has and no scan knows of."
    )
