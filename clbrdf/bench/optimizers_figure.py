"""A comparison of optimizers on one page: ECDF by evaluations and by seconds, data profile, success rates."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from clbrdf.bench.comparison import TARGETS
from clbrdf.bench.profiles import Costs, data_profile, ecdf, ecdf_band, success_rates
from clbrdf.bench.verdict import QUALITY, title
from clbrdf.fit import METHODS
from clbrdf.viz.curves import COLOURS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LINES = ("-", "--", ":")
POINTS = 200


def optimizers_figure(table: Sequence[Costs], parameters: int, subtitle: str) -> Figure:
    """Draw four panels; contenders in the order of what they reach, ours in heavy lines.

    Parameters
    ----------
    table : sequence of Costs
    parameters : int
        P, for the data profile.
    subtitle : str
        What was run, and where.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.5, 8.6), layout="constrained")
    (by_evaluations, by_seconds), (profile, success) = figure.subplots(2, 2)
    ranked = sorted(table, key=lambda c: (-np.isfinite(c.evaluations).mean(), np.median(c.spent)))
    styles = {c.contender: _style(k, c.contender) for k, c in enumerate(ranked)}
    for axes, axis, label in (
        (by_evaluations, "evaluations", "evaluations"),
        (by_seconds, "seconds", "seconds a wavelength"),
    ):
        _draw_ecdf(axes, ranked, styles, axis)
        axes.set_xlabel(label)
    by_evaluations.set_title("(a) targets 1e-1 … 1e-8 reached, by evaluations", fontsize=10)
    by_seconds.set_title("(b) the same by time", fontsize=10)
    grid = _grid([c.evaluations / (parameters + 1) for c in ranked])
    for costs in ranked:
        share = 100.0 * data_profile(costs, QUALITY, grid, parameters)
        profile.step(grid, share, where="post", **styles[costs.contender])
        success.plot(TARGETS, 100.0 * success_rates(costs), **styles[costs.contender])
    profile.set_xscale("log")
    profile.set_xlabel(f"evaluations / (P + 1), P = {parameters}")
    profile.set_ylabel("wavelengths solved (%)")
    profile.set_title(f"(c) data profile: gap {QUALITY:g}, median seed", fontsize=10)
    success.set_xscale("log")
    success.invert_xaxis()
    success.set_xlabel("target: relative gap to the reference optimum")
    success.set_ylabel("runs that reach it (%)")
    success.set_title("(d) success", fontsize=10)
    for axes in (by_evaluations, by_seconds, profile, success):
        axes.set_ylim(-3.0, 103.0)
        axes.grid(alpha=0.3, which="major")
    handles, labels = success.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside right center", fontsize=8, frameon=False)
    figure.suptitle(f"Which optimizer: {subtitle}", fontsize=11)
    return figure


def _style(rank: int, contender: str) -> dict[str, Any]:
    ours = contender in METHODS
    return {
        "label": title(contender),
        "color": COLOURS[rank % len(COLOURS)],
        "linestyle": LINES[rank // len(COLOURS) % len(LINES)],
        "linewidth": 2.6 if ours else 1.2,
    }


def _grid(costs: Sequence[npt.NDArray[np.float64]]) -> npt.NDArray[np.float64]:
    """Return budgets from the smallest cost to a little more than the largest."""
    reached = np.concatenate([c[np.isfinite(c)] for c in costs])
    if len(reached) == 0:
        return np.array([1.0, 10.0])
    return np.geomspace(max(0.7 * reached.min(), 1e-9), 1.5 * reached.max(), POINTS)


def _draw_ecdf(axes: Axes, ranked: Sequence[Costs], styles: dict[str, dict[str, Any]], axis: str) -> None:
    grid = _grid([c.of(axis)[0] for c in ranked])
    for costs in ranked:
        to_target, style = costs.of(axis)[0], styles[costs.contender]
        low, high = ecdf_band(to_target, grid)
        axes.fill_between(grid, 100.0 * low, 100.0 * high, color=style["color"], alpha=0.12, linewidth=0.0)
        axes.plot(grid, 100.0 * ecdf(to_target, grid), **style)
    axes.set_xscale("log")
    axes.set_ylabel("targets reached (%)")
