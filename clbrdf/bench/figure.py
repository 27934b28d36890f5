"""The price of accuracy on one page: a panel for each work-precision table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from clbrdf.bench.accuracy import CostPanel
from clbrdf.viz.curves import COLOURS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MARKERS = "os^Dv*"


def accuracy_figure(panels: Sequence[CostPanel], device: str) -> Figure:
    """Draw the panels, time to the right, error upwards, both logarithmic."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.5, 8.6), layout="constrained")
    for axes, panel in zip(figure.subplots(2, 2).ravel(), panels, strict=True):
        _draw(axes, panel)
    figure.suptitle(f"What accuracy costs: {device}", fontsize=11)
    return figure


def _draw(axes: Axes, panel: CostPanel) -> None:
    from matplotlib.ticker import LogFormatterSciNotation, NullFormatter

    series = list(dict.fromkeys(point.series for point in panel.points))
    for k, name in enumerate(series):
        points = [point for point in panel.points if point.series == name]
        colour, marker = COLOURS[k % len(COLOURS)], MARKERS[k % len(MARKERS)]
        seconds, errors = [p.seconds for p in points], [p.error for p in points]
        axes.plot(seconds, errors, label=name, linewidth=0.8, color=colour, marker=marker)
    named = {point.name for point in panel.points if len(point.name) < 10}
    for point in panel.points:
        if point.name in named and point.series == series[0]:
            place = (point.seconds, point.error)
            axes.annotate(point.name, place, xytext=(4, 5), textcoords="offset points", fontsize=8)
    axes.set_xscale("log")
    seconds = [p.seconds for p in panel.points]
    if max(seconds) < 5.0 * min(seconds):
        axes.xaxis.set_minor_formatter(LogFormatterSciNotation(minor_thresholds=(1.0, 0.3)))
        axes.tick_params(axis="x", which="minor", labelsize=8)
    else:
        axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_yscale("log")
    axes.set_title(panel.title, fontsize=10)
    axes.set_xlabel(panel.work)
    axes.set_ylabel(panel.error)
    axes.legend(fontsize=8, frameon=False)
    axes.grid(alpha=0.3, which="major")
