"""Measured BRDF against the fitted model, as flat figures (Figs. 5 and 9-11 of Wang et al. 2013)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.fit import Fit
from clbrdf.geometry import Directions
from clbrdf.scan import Scan
from clbrdf.storage.files import whole_file

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = npt.NDArray[np.float64]

IN_PLANE = 1e-6
"""Degrees from φ = 0 or 180° within which a direction counts as in the plane of incidence."""

WIDE_RANGE = 30.0
"""Ratio of largest to smallest value from which an axis is logarithmic."""

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
"""Told apart with colour-blind eyes and in grey: Okabe and Ito, Color Universal Design (2008)."""


def signed_view_zenith(scan: Scan) -> Array:
    """θr with the sign of the half-plane, (N,): positive forward (φ = 180°), negative on the source's side.

    NaN outside the plane of incidence.
    """
    turned = np.abs(scan.phi - 180.0)
    forward, backward = turned <= IN_PLANE, np.abs(turned - 180.0) <= IN_PLANE
    vertical = scan.theta_r == 0.0
    return np.where(forward | vertical, scan.theta_r, np.where(backward, -scan.theta_r, np.nan))


def seen_along(fit: Fit, directions: Directions, column: int) -> Array:
    """Fitted values (N,), 1/sr, at one wavelength as the detector sees them: what compares with points.

    NaN where the detector would look below the horizon.
    """
    if fit.through is None:
        return np.ravel(fit.forward(directions).brdf(fit.vector[column][None, :]))
    from clbrdf.instrument.place import above_horizon

    behind = fit.through.elsewhere(directions)
    there = above_horizon(behind.instrument, behind.angle, directions)
    out = np.full(len(directions), np.nan)
    if not there.any():
        return out
    if behind.instrument.bandwidth is not None:
        out[there] = fit.predict_seen(directions[there])[:, column]  # a slit mixes all wavelengths
    else:
        out[there] = np.ravel(fit.forward(directions[there]).brdf(fit.vector[column][None, :]))
    return out


def model_word(fit: Fit) -> str:
    """Return what figures call the model that they compare with points."""
    return "model" if fit.through is None else "model as the detector sees it"


def measured_and_model(fit: Fit, wavelengths: npt.ArrayLike | None = None) -> Figure:
    """Draw measured points and the model in the plane of incidence, residuals below (Figs. 9-11).

    Parameters
    ----------
    fit : Fit
    wavelengths : array-like, optional
        nm, at most six; the nearest measured ones are drawn. By default three across the range.

    Raises
    ------
    InputError
        No unmasked direction in the plane of incidence.
    """
    from matplotlib.figure import Figure

    scan, zenith = fit.scan, signed_view_zenith(fit.scan)
    angles = [a for a in scan.incident_angles if np.isfinite(zenith[scan.theta_i == a]).sum() > 2]
    if not angles:
        raise InputError("no incident zenith has three directions in its plane of incidence; nothing to draw")
    places = _places(fit, wavelengths)
    values = fit.observed()
    figure = Figure(figsize=(max(6.0, 3.6 * len(angles) + 0.6), 5.6), layout="constrained")
    grid = figure.subplots(2, len(angles), sharex="col", sharey="row", squeeze=False, height_ratios=(3, 1))
    good = scan.brdf[~scan.mask]
    for column, angle in enumerate(angles):
        top, bottom = grid[0, column], grid[1, column]
        here = np.flatnonzero((scan.theta_i == angle) & np.isfinite(zenith))
        here = here[np.argsort(zenith[here], kind="stable")]
        for k, colour in zip(places, COLOURS, strict=False):
            _cut(top, bottom, fit, k, angle, here, zenith, values, colour)
        if good.max() > WIDE_RANGE * good.min():
            top.set_yscale("log")
            top.set_ylim(good.min() / 2.0, good.max() * 2.0)
        top.set_title(f"θi = {angle:g}°")
        bottom.axhline(0.0, color="0.5", linewidth=0.8)
        bottom.set_xlabel("view zenith θr (°)")
    grid[0, 0].set_ylabel("BRDF (1/sr)")
    grid[1, 0].set_ylabel("deviation (%)")
    grid[0, -1].legend(fontsize=8, frameon=False)
    forward_only = np.nanmin(zenith) >= 0.0
    side = "" if forward_only else "; θr < 0 on the source's side"
    figure.suptitle(f"{scan.sample}: measured (points) and {model_word(fit)} (lines){side}", fontsize=11)
    return figure


def _places(fit: Fit, wavelengths: npt.ArrayLike | None) -> list[int]:
    fitted = np.flatnonzero(np.isfinite(fit.objective))
    if wavelengths is None:
        quarters = fitted[np.linspace(0, len(fitted) - 1, 5).round().astype(int)]
        return sorted({int(k) for k in quarters[1:4]})
    wanted = np.atleast_1d(np.asarray(wavelengths, dtype=np.float64))[: len(COLOURS)]
    return sorted({int(np.abs(fit.wavelength - w).argmin()) for w in wanted})


def _cut(
    top: Axes,
    bottom: Axes,
    fit: Fit,
    k: int,
    angle: float,
    here: npt.NDArray[np.intp],
    zenith: Array,
    values: Array,
    colour: str,
) -> None:
    """Draw one wavelength at one incident zenith."""
    scan = fit.scan
    used = here[~scan.mask[here, k]]
    left_out = here[scan.mask[here, k] & (scan.brdf[here, k] > 0.0)]
    style: dict[str, Any] = {"color": colour, "linestyle": "none", "markersize": 3.0}
    top.plot(zenith[used], scan.brdf[used, k], marker="o", label=scan.labels[k], **style)
    top.plot(zenith[left_out], scan.brdf[left_out, k], marker="x", **style)
    fine = np.linspace(zenith[here].min(), zenith[here].max(), 721)
    phi_i = scan.phi_i[here[0]]
    line = Directions(np.full(1, angle), phi_i, np.abs(fine), np.where(fine < 0.0, 0.0, 180.0) + phi_i)
    model = seen_along(fit, line, k)
    top.plot(fine, model, color=colour, linewidth=1.0)
    deviation = 100.0 * (values[used, k] / scan.brdf[used, k] - 1.0)
    bottom.plot(zenith[used], deviation, marker=".", **style)


def spectral_map(fit: Fit) -> Figure:
    """Draw the BRDF over wavelength and view angle, measured above and model below (Fig. 5).

    Raises
    ------
    InputError
        Fewer than two wavelengths, or no unmasked direction in the plane of incidence.
    """
    from matplotlib.colors import LogNorm
    from matplotlib.figure import Figure

    scan, zenith = fit.scan, signed_view_zenith(fit.scan)
    angles = [a for a in scan.incident_angles if np.isfinite(zenith[scan.theta_i == a]).sum() > 2]
    if len(scan.wavelength) < 2 or not angles:
        raise InputError(
            "a map over wavelength needs two wavelengths and a plane of incidence with directions"
        )
    measured = np.where(scan.mask, np.nan, scan.brdf)
    norm = LogNorm(np.nanmin(measured), np.nanmax(measured))
    figure = Figure(figsize=(max(6.0, 3.4 * len(angles) + 1.2), 6.0), layout="constrained")
    grid = figure.subplots(2, len(angles), sharex=True, sharey="col", squeeze=False)
    for row, values in enumerate((measured, fit.observed())):
        for column, angle in enumerate(angles):
            here = np.flatnonzero((scan.theta_i == angle) & np.isfinite(zenith))
            _, first = np.unique(zenith[here], return_index=True)
            here = here[first]
            image = grid[row, column].pcolormesh(
                fit.wavelength, zenith[here], values[here], norm=norm, cmap="viridis", shading="nearest"
            )
            kind = "measured" if row == 0 else "model" if fit.through is None else "model, as seen"
            grid[row, column].set_title(f"θi = {angle:g}°, {kind}", fontsize=10)
    for axes in grid[1]:
        axes.set_xlabel("wavelength (nm)")
    for axes in grid[:, 0]:
        axes.set_ylabel("view zenith θr (°)")
    figure.colorbar(image, ax=grid, label="BRDF (1/sr)")
    figure.suptitle(scan.sample, fontsize=11)
    return figure


def save_figure(figure: Figure, path: str | Path, overwrite: bool = False, dpi: int = 120) -> None:
    """Write a figure, whole or not at all; the format follows the name's end (.png, .svg, .pdf).

    Raises
    ------
    InputError
        The file exists and `overwrite` is False, cannot be written, or has an unknown end.
    """
    kind = Path(path).suffix.lstrip(".").casefold()
    if kind not in figure.canvas.get_supported_filetypes():
        raise InputError(f"{path}: pictures end in .png, .svg or .pdf")
    with whole_file(path, overwrite) as part:
        figure.savefig(part, dpi=dpi, format=kind)
