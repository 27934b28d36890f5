"""Time and memory of fits over the size of the scan."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from clbrdf.bench.scaling import FEW, MERL, USUAL, ScalingPoint
from clbrdf.viz.curves import COLOURS

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def scaling_figure(points: Sequence[ScalingPoint], device: str) -> Figure:
    """Draw nanoseconds a value and peak memory, over directions on the left and wavelengths on the right."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.5, 7.0), layout="constrained")
    axes = figure.subplots(2, 2, sharex="col", sharey="row")
    usual = [p for p in points if p.model != MERL[2]]
    over = (
        (
            f"directions, at {FEW} wavelengths",
            [p for p in usual if p.wavelengths == FEW and p.directions != USUAL],
        ),
        (f"wavelengths, in {USUAL} directions", [p for p in usual if p.directions == USUAL]),
    )
    for column, (words, some) in enumerate(over):
        sizes = [p.wavelengths if column else p.directions for p in some]
        cpu = [1e9 * p.cpu / (p.directions * p.wavelengths) for p in some]
        style = {"linewidth": 0.8, "marker": "o"}
        axes[0, column].plot(sizes, [p.each for p in some], label="wall time", color=COLOURS[0], **style)
        axes[0, column].plot(sizes, cpu, label="all cores together", color=COLOURS[1], **style)
        axes[0, column].set_yscale("log")
        axes[1, column].plot(sizes, [p.peak / 1e9 for p in some], color=COLOURS[0], **style)
        axes[1, column].set_ylim(bottom=0.0)
        axes[1, column].set_xscale("log")
        axes[1, column].set_xlabel(words)
        for row in axes[:, column]:
            row.grid(alpha=0.3, which="major")
    axes[0, 0].set_ylabel("ns a wavelength and direction")
    axes[1, 0].set_ylabel("peak memory, GB")
    axes[0, 0].legend(fontsize=8, frameon=False)
    figure.suptitle(f"Whole fits of wang2013: {device}", fontsize=11)
    return figure
