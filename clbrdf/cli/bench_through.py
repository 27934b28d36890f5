"""`clbrdf bench through`: bias and time of fits through an aperture, beside fits of points."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from clbrdf.bench.through import NOISE, WAVELENGTHS, run
from clbrdf.cli.console import number, print_table, progress_bar, stdout_console
from clbrdf.opencl.device import Device


def bench_through(device: Device) -> dict[str, Any]:
    """Fit made scans both ways, print a row for each, return all of them."""
    with progress_bar("apertures") as report:
        rows = run(device, report=report)
    text = [
        [
            row.model,
            f"{row.ratio:g}",
            f"{row.angle:.2f}°",
            number(row.bias_point, 3),
            f"{row.bias_through:.3f}",
            f"{row.milliseconds_point:.2f}",
            f"{row.milliseconds_through:.2f}",
            f"{row.milliseconds_through / row.milliseconds_point:.1f}",
            f"{row.nodes:.1f}",
        ]
        for row in rows
    ]
    heads = ("", "R/w", "aperture", "points", "through", "points", "through", "×", "nodes")
    print_table("Bias (σ), then milliseconds a wavelength", heads, text, left=1)
    stdout_console().print(
        f"R/w: half-angle of the aperture over the lobe's half-width. Bias: the largest of all parameters at"
        f" {WAVELENGTHS} wavelengths, in units of its standard uncertainty, for {100 * NOISE:g} % of noise"
        " that is told and not there. Milliseconds are of all cores together; nodes are of a direction."
    )
    return {"noise": NOISE, "wavelengths": WAVELENGTHS, "rows": [asdict(row) for row in rows]}
