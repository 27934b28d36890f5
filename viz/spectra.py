"""Parameters and quality of a fit over the wavelength, as flat figures."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from clbrdf.fit.budget import half_sigma, has_halves
from clbrdf.fit.result import Fit
from clbrdf.viz.style import BLACK, BLUE, SERIES, VERMILION

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MARKERS = ("o", "s", "^", "D", "v", "P", "X")
FEW = 40
"""Up to so many wavelengths each gets a mark."""


def parameter_spectra(fit: Fit) -> Figure:
    """Draw every parameter over the wavelength with its 1σ band (P panels).

    A darker band within is the random part of 1σ, of errors that differ from direction to direction, where
    others are common; upright lines are profile-likelihood intervals, where the fit has them.
    Wavelengths where an uncertainty is not known (at a bound, or not determined by the data) carry an open
    mark and no band; those that did not converge a cross.
    """
    from matplotlib.figure import Figure

    names = fit.model.names
    figure = Figure(figsize=(9.6, 2.5 * -(-len(names) // 2)), layout="constrained")
    grid = figure.subplots(-(-len(names) // 2), 2, sharex=True, squeeze=False)
    bad = np.isin(fit.status, ("not converged",))
    for axes, name in zip(grid.ravel(), names, strict=False):
        _parameter(axes, fit, name, bad)
    for axes in grid.ravel()[len(names) :]:
        axes.set_visible(False)
    for axes in grid[-1]:
        axes.set_xlabel("wavelength (nm)")
    return figure


def spectra_words(fit: Fit) -> str:
    """Return what the bands and upright lines of `parameter_spectra` are."""
    words = "Bands: 1σ."
    if has_halves(fit):
        words = (
            "Bands: 1σ; darker within, its random part, of errors that differ from direction to direction."
        )
    return words + (" Upright lines: 68.3 % intervals by profile likelihood." if fit.intervals else "")


def _parameter(axes: Axes, fit: Fit, name: str, bad: np.ndarray) -> None:
    wavelength, value, sigma = fit.wavelength, fit.parameters[name], fit.sigma[name]
    known = np.isfinite(value) & np.isfinite(sigma)
    band = np.where(known, sigma, np.nan)
    axes.plot(wavelength, value, color=BLUE, linewidth=1.2)
    axes.fill_between(wavelength, value - band, value + band, color=BLUE, alpha=0.25, linewidth=0)
    if len(wavelength) <= FEW:
        axes.errorbar(wavelength, value, np.nan_to_num(band), color=BLUE, fmt="o", markersize=3, capsize=2)
    if has_halves(fit):
        random = half_sigma(fit, False)[:, fit.model.names.index(name)]
        axes.fill_between(wavelength, value - random, value + random, color=BLUE, alpha=0.25, linewidth=0)
    if name in fit.intervals:
        axes.vlines(wavelength, *fit.intervals[name].T, color=BLACK, linewidth=0.8)
    unknown = np.isfinite(value) & ~np.isfinite(sigma)
    axes.plot(
        wavelength[unknown],
        value[unknown],
        linestyle="none",
        marker="o",
        markerfacecolor="white",
        color=BLACK,
        markersize=4,
    )
    axes.plot(wavelength[bad], value[bad], linestyle="none", marker="x", color=VERMILION, markersize=6)
    row = next(p for p in fit.model.parameters if p.name == name)
    axes.set_title(f"{name}: {row.meaning}", fontsize=9)
    axes.set_ylabel(name)
    axes.grid(alpha=0.25)
    # A band that fills decades would flatten the curve itself.
    if known.any():
        low, high = np.nanmin(value), np.nanmax(value)
        reach = max(high - low, 3.0 * float(np.nanmedian(sigma[known])), 1e-9 * abs(high), 1e-30)
        low, high = low - 0.6 * reach, high + 0.6 * reach
        if name in fit.intervals and np.isfinite(fit.intervals[name]).all(axis=1).any():
            lower, upper = np.nanpercentile(fit.intervals[name], [10.0, 90.0], axis=0)[[0, 1], [0, 1]]
            low, high = min(low, lower), max(high, upper)
        axes.set_ylim(low, high)


def quality_spectra(fit: Fit) -> Figure:
    """Draw E of (13) and σ_r of (14) over the wavelength, σ_r for each incident zenith as in Table 2."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.6, 3.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    marks = len(fit.wavelength) <= FEW
    left.plot(fit.wavelength, fit.objective, color=BLACK, marker="o" if marks else None, markersize=3)
    good = fit.objective[np.isfinite(fit.objective) & (fit.objective > 0.0)]
    if good.size and good.max() > 30.0 * good.min():
        left.set_yscale("log")
    left.set_ylabel("E (13)")
    rows = zip(fit.scan.incident_angles, fit.goodness.relative_rms_by_incident_angle, strict=True)
    for k, (angle, values) in enumerate(rows):
        right.plot(
            fit.wavelength,
            100.0 * values,
            color=SERIES[k % len(SERIES)],
            marker=MARKERS[k % len(MARKERS)],
            markevery=max(1, len(fit.wavelength) // 8),
            markersize=4,
            label=f"θi = {angle:g}°",
        )
    right.set_ylabel("σr (14), %")
    right.set_ylim(bottom=0.0)
    right.legend(fontsize=8, frameon=False)
    for axes in (left, right):
        axes.set_xlabel("wavelength (nm)")
        axes.grid(alpha=0.25)
    return figure
