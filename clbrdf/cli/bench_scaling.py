"""`clbrdf bench scaling`: time and memory over the size of a scan."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from clbrdf.bench.scaling import MERL, ScalingPoint, as_rows, measure_sizes
from clbrdf.bench.scaling_figure import scaling_figure
from clbrdf.cli.console import print_table, progress_bar
from clbrdf.opencl.device import Device
from clbrdf.viz.curves import save_figure


def bench_scaling(device: Device, png: Path | None, overwrite: bool) -> dict[str, Any]:
    """Measure, print the table, draw the figure; return all numbers."""
    with progress_bar("fits") as report:
        points = measure_sizes(device, report)
    print(f"{device}, {device.compute_units} units\n")
    heads = ("", "N", "W", "seconds", "all cores, s", "ns a value", "peak GB", "E above full search")
    print_table("Fits of N directions × W wavelengths", heads, [_row(point) for point in points])
    if png is not None:
        save_figure(scaling_figure(points, str(device)), png, overwrite)
    return {"scaling": as_rows(points)}


def _row(point: ScalingPoint) -> list[str]:
    size = point.directions, point.wavelengths, point.model
    return [
        f"{point.model}, as MERL" if size == MERL else point.model,
        *(str(point.directions), str(point.wavelengths)),
        *(f"{value:.3g}" for value in (point.seconds, point.cpu, point.each)),
        f"{point.peak / 1e9:.2f}",
        "" if np.isnan(point.excess) else f"{max(point.excess, 0.0):.0e}",
    ]
