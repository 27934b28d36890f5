"""What each model predicted of the incident angles that it had not seen, as a flat figure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from clbrdf.choose.result import Choice
from clbrdf.viz.style import BLUE, GREY, PALE, SERIES

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_ANGLES = len(SERIES)
"""Incident angles with a colour of their own; of more, an even choice is marked."""


def score_chart(choice: Choice) -> Figure:
    """Draw a bar for each model, the best on top, with a dot for each incident angle; percent."""
    from matplotlib.figure import Figure

    count = len(choice.ranking)
    drawn = Figure(figsize=(9.6, 1.2 + 0.32 * count), layout="constrained")
    axes = drawn.subplots()
    by_angle = 100.0 * np.sqrt(np.nanmean(np.stack([row.score for row in choice.ranking]), axis=2))
    whole = np.array([100.0 * row.predicted for row in choice.ranking])
    finite = np.isfinite(by_angle) & (by_angle > 0.0)
    low = 0.7 * by_angle[finite].min()
    places = np.arange(count)
    colours = [
        BLUE if row.model == choice.chosen else "#c9c9c9" if row.within else PALE for row in choice.ranking
    ]
    shown = np.where(np.isfinite(whole), whole, by_angle[finite].max())
    axes.barh(places, shown - low, left=low, height=0.7, color=colours)
    marked = np.unique(np.linspace(0, len(choice.theta_i) - 1, MOST_ANGLES).round().astype(int))
    for k, colour in zip(marked, SERIES, strict=False):
        style: dict[str, Any] = {"s": 26, "color": colour, "edgecolor": "white", "zorder": 3}
        axes.scatter(by_angle[:, k], places, label=f"θi = {choice.theta_i[k]:.3g}°", **style)
    axes.set_xscale("log")
    axes.set_xlim(left=low)
    axes.set_yticks(places, [f"{row.model} ({row.free})" for row in choice.ranking])
    axes.invert_yaxis()
    axes.set_xlabel("deviation of what was predicted (%)")
    axes.grid(axis="x", color=GREY, alpha=0.3, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.legend(fontsize=8, frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    axes.set_title(
        "blue: chosen; darker grey: within one standard error; in brackets: parameters", fontsize=9
    )
    return drawn
