"""Where models miss the data, over the view directions of each incident angle, as a flat figure."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from clbrdf.choose.angles import incident_groups
from clbrdf.choose.result import Choice
from clbrdf.objective import weight_matrix
from clbrdf.viz.curves import signed_view_zenith
from clbrdf.viz.style import BLACK, DIFFERENCE_MAP, GREY, SERIES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = npt.NDArray[np.float64]

MODELS = 4
"""Of the ranking, the chosen one among them."""

MOST_ANGLES = 5
"""Incident angles that are drawn, spread evenly."""

LARGEST = 100.0
SMALLEST = 1.0
"""Percent: limits of the colour scale."""

COVERED = 98.0
"""Percent of the deviations that the colour scale holds; the rest is drawn in its end colours."""

FEW_PLANES = 3
"""Distinct azimuths in fewer of which there is no map to draw, but lines."""


def shown_models(choice: Choice) -> tuple[str, ...]:
    """Names of the models that are drawn: the chosen one first, then the best of the others."""
    others = [row.model for row in choice.ranking if row.model != choice.chosen]
    return (choice.chosen, *others[: MODELS - 1])


def residual_maps(choice: Choice) -> Figure:
    """Draw relative residuals of the best few models over (θr, φ), or along θr where all lie in one plane."""
    scan = choice.scan
    groups = incident_groups(scan)
    angles = np.unique(np.linspace(0, len(groups.theta_i) - 1, MOST_ANGLES).round().astype(int))
    deviations = {name: _deviation(choice, name) for name in shown_models(choice)}
    rows = [np.flatnonzero(groups.group == k) for k in angles]
    titles = [f"θi = {groups.theta_i[k]:.3g}°" for k in angles]
    if len(np.unique(np.round(scan.phi % 180.0, 3))) < FEW_PLANES:
        return _lines(choice, deviations, rows, titles)
    return _maps(choice, deviations, rows, titles)


def _deviation(choice: Choice, model: str) -> Array:
    """Mean over wavelengths of model/measured − 1 in percent, (N,); NaN where nothing was used."""
    scan = choice.scan
    used = (weight_matrix(scan, "none") > 0.0) & (scan.brdf > 0.0)
    ratio = np.divide(choice.values(model), scan.brdf, out=np.ones_like(scan.brdf), where=used) - 1.0
    count = used.sum(axis=1)
    return np.where(count > 0, 100.0 * np.where(used, ratio, 0.0).sum(axis=1) / np.maximum(count, 1), np.nan)


def _lines(
    choice: Choice, deviations: dict[str, Array], rows: list[npt.NDArray[np.intp]], titles: list[str]
) -> Figure:
    from matplotlib.figure import Figure

    scan, zenith = choice.scan, signed_view_zenith(choice.scan)
    zenith = np.where(np.isfinite(zenith), zenith, scan.theta_r)
    drawn = Figure(figsize=(max(6.0, 3.0 * len(rows) + 0.6), 3.8), layout="constrained")
    grid = drawn.subplots(1, len(rows), sharey=True, squeeze=False)[0]
    for axes, here, title in zip(grid, rows, titles, strict=True):
        ordered = here[np.argsort(zenith[here], kind="stable")]
        for (name, values), colour in zip(deviations.items(), SERIES, strict=False):
            width = 1.8 if name == choice.chosen else 1.0
            axes.plot(zenith[ordered], values[ordered], ".-", color=colour, linewidth=width, label=name)
        axes.axhline(0.0, color=GREY, linewidth=0.8)
        axes.axvline(float(scan.theta_i[here].mean()), color=GREY, linewidth=0.8, linestyle=":")
        axes.set_title(title, fontsize=10)
        axes.set_xlabel("θr (°), forward positive")
    limit = _limit(deviations)
    grid[0].set_ylim(-1.1 * limit, 1.1 * limit)
    grid[0].set_ylabel("model less measured (%)")
    drawn.legend(
        *grid[0].get_legend_handles_labels(), fontsize=8, frameon=False, loc="outside upper center", ncols=4
    )
    return drawn


def _maps(
    choice: Choice, deviations: dict[str, Array], rows: list[npt.NDArray[np.intp]], titles: list[str]
) -> Figure:
    from matplotlib.figure import Figure

    scan, limit = choice.scan, _limit(deviations)
    half = bool((scan.phi <= 180.0).all())
    height = 1.45 if half else 2.6
    drawn = Figure(figsize=(2.6 * len(rows) + 1.6, height * len(deviations) + 0.8), layout="constrained")
    grid = drawn.subplots(len(deviations), len(rows), squeeze=False)
    phi = np.deg2rad(scan.phi)
    across, up = -scan.theta_r * np.cos(phi), scan.theta_r * np.sin(phi)
    for line, (name, values) in zip(grid, deviations.items(), strict=True):
        for axes, here, title in zip(line, rows, titles, strict=True):
            known = here[np.isfinite(values[here])]
            image = axes.scatter(
                across[known],
                up[known],
                c=values[known],
                s=_mark(len(known), half),
                cmap=DIFFERENCE_MAP,
                vmin=-limit,
                vmax=limit,
                linewidths=0,
            )
            _frame(axes, half, float(scan.theta_i[here].mean()))
            if axes in grid[0]:
                axes.set_title(title, fontsize=10)
        mark = " (chosen)" if name == choice.chosen else ""
        line[0].set_ylabel(
            f"{name}{mark}".replace("+", "+\n"), fontsize=8, rotation=0, ha="right", va="center"
        )
    drawn.colorbar(image, ax=grid, label="model less measured (%)", extend="both", aspect=30)
    drawn.suptitle(
        "view directions, forward to the right; rings θr = 30°, 60°, 90°; circle: mirror direction",
        fontsize=9,
    )
    return drawn


def _frame(axes: Axes, half: bool, theta_i: float) -> None:
    """Draw rings of θr and the mirror direction, and no box."""
    turn = np.linspace(0.0, np.pi if half else 2.0 * np.pi, 91)
    for ring in (30.0, 60.0, 90.0):
        axes.plot(ring * np.cos(turn), ring * np.sin(turn), color=GREY, linewidth=0.5)
    axes.plot([-90.0, 90.0], [0.0, 0.0], color=GREY, linewidth=0.5)
    axes.plot(theta_i, 0.0, "o", markersize=7, markerfacecolor="none", markeredgecolor=BLACK, clip_on=False)
    axes.set_aspect("equal")
    axes.set_xlim(-92.0, 92.0)
    axes.set_ylim(-6.0 if half else -92.0, 92.0)
    axes.set_xticks([])
    axes.set_yticks([])
    for side in axes.spines.values():
        side.set_visible(False)


def _mark(count: int, half: bool) -> float:
    """Area of a mark in points² so that evenly spread directions nearly touch."""
    area = np.pi * 90.0**2 * (0.5 if half else 1.0)
    return float(np.clip(0.55 * area / max(count, 1), 4.0, 120.0))


def _limit(deviations: dict[str, Array]) -> float:
    """End of the colour scale, percent, the same for all models."""
    sizes = np.abs(np.concatenate(list(deviations.values())))
    return float(np.clip(np.nanpercentile(sizes, COVERED), SMALLEST, LARGEST))
