"""`clbrdf bench coverage`: whether error bars cover what they claim."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from clbrdf.bench.coverage import ANGLE, CASES, NOISE, SCALE, Coverage, MeanCheck, coverage, mean_check
from clbrdf.cli.console import number, print_table, progress_bar, stdout_console
from clbrdf.errors import InputError
from clbrdf.opencl.device import Device

SCANS = 500


def bench_coverage(device: Device, scans: int | None = None) -> dict[str, Any]:
    """Fit made scans, print how often 1σ held the truth, return all figures.

    Raises
    ------
    InputError
        Fewer scans than 50.
    """
    count = SCANS if scans is None else scans
    if count < 50:
        raise InputError(f"--seeds {count}: coverage needs 50 made scans or more")
    rows: list[Coverage] = []
    with progress_bar("made scans") as report:
        for name in CASES:
            rows += coverage(name, count, device=device, report=report)
        mean = mean_check(device=device, report=report)
    print_coverage(rows, mean, count)
    return {"coverage": [asdict(row) for row in rows], "mean": asdict(mean)}


def print_coverage(rows: list[Coverage], mean: MeanCheck, count: int) -> None:
    """Print a row for each parameter, and the mean over wavelengths."""
    text = [
        [
            row.model,
            row.parameter,
            f"{100 * row.carried:.1f} %",
            f"{100 * row.ignored:.1f} %",
            f"{100 * row.bar:.3g} %",
            f"{100 * row.bar_ignored:.3g} %",
            f"{100 * row.scatter:.3g} %",
        ]
        for row in rows
    ]
    heads = ("model", "parameter", "1σ holds", "ignored", "1σ", "ignored", "scatter")
    print_table(f"Truth within 1σ, of {count} made scans", heads, text, left=2)
    scatter = 100.0 * (0.6827 * 0.3173 / count) ** 0.5
    stdout_console().print(
        f"Expected: 68.3 %, with a scatter of {scatter:.1f} % for {count} scans. Noise {100 * NOISE:g} % of"
        f" each value, a scale error of {100 * SCALE:g} % of each scan, and {ANGLE:g}° of each incident"
        " angle. 'ignored' takes the same total for independent, value by value.\n"
    )
    told = [[f"{number(100 * size, 3)} %" for size in (mean.claimed, mean.independent, mean.actual)]]
    of_means = ("1σ, with covariances between wavelengths", "without", "scatter of the means")
    title = f"Mean of {mean.parameter} over {mean.wavelengths} wavelengths, {mean.scans} made scans"
    print_table(title, of_means, told)
