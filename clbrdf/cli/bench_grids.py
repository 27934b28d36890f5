"""`clbrdf bench grids`: tables."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from clbrdf.bench.grids import GridRun, measure_grids
from clbrdf.cli.console import print_table, progress_bar
from clbrdf.opencl.device import Device

REFERENCE = {"in memory": "evaluate", "hemisphere": "kernel alone"}
"""What a grid's times are compared with, in the same precision."""


def bench_grids(device: Device) -> dict[str, Any]:
    """Time grids of values; print tables, return all numbers."""
    with progress_bar("grids") as report:
        runs = measure_grids(device, report)
    print(f"{device}, {device.compute_units} units\n")
    for grid, reference in REFERENCE.items():
        some = [run for run in runs if run.grid == grid]
        rows = [
            [
                run.name,
                f"{1e3 * run.median:.1f}",
                f"{run.values / run.median / 1e6:.0f}",
                f"{ratio(run, some, reference):.3f}",
                f"{1e3 * float(np.median(run.syncing)):.0f}" if run.syncing else "",
            ]
            for run in some
        ]
        heads = ("", "ms", "million values/s", f"× {reference}", "sync, ms")
        print_table(f"{grid}, {some[0].values / 1e6:.1f} million values", heads, rows)
    return {"grids": [asdict(run) for run in runs]}


def ratio(run: GridRun, runs: list[GridRun], reference: str) -> float:
    """Median of the ratios, round by round, to the reference of the same precision."""
    precision = run.name.rsplit(", ", 1)[1]
    other = next(r for r in runs if r.name == f"{reference}, {precision}")
    return float(np.median(np.divide(run.seconds, other.seconds)))
