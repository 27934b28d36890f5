"""Still pictures of a subject for readers of a page without scripts, and of what a page cannot compute."""

from __future__ import annotations

import base64
import io
from html import escape
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from clbrdf.fit.words import through_lines
from clbrdf.viz.curves import seen_along
from clbrdf.viz.style import BLACK, BLUE, DIFFERENCE_MAP, GREY, VALUE_MAP
from clbrdf.viz.subject import Subject

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = npt.NDArray[np.float64]

WIDE_RANGE = 50.0
"""Largest over smallest value from which scales are logarithmic."""
MOST_POINTS = 3000
DPI = 88
COLOURS = 96
"""Of the picture's palette: small, and enough for two colour scales and letters."""


def still_html(subject: Subject) -> str:
    """Return pictures of a scan or a fit at its usual angle and wavelength, as HTML."""
    theta_i, column = subject.default_incident(), subject.column(subject.default_wavelength())
    words = f"{subject.name}: θi = {theta_i:g}°, {subject.label(column)}."
    if subject.fit is not None and subject.sees:
        told = through_lines(subject.fit)[0]
        words += f" Residuals, cut and spectrum are of what the detector sees through: {told}."
    data = base64.b64encode(_png(still_figure(subject, theta_i, column))).decode("ascii")
    text = escape(
        f"{words} Above: maps over θr and φ, equal-area, φ = 180° (forward) to the right;"
        " dotted: largest θr measured; below: the cut in the plane of incidence and the spectrum nearest"
        " to the mirror direction."
    )
    image = f'<img src="data:image/png;base64,{data}" alt="{text}">'
    return f"<figure>{image}<figcaption>{text}</figcaption></figure>"


def still_figure(subject: Subject, theta_i: float, column: int) -> Figure:
    """Draw maps, cut and spectrum at an incident zenith, degrees, and a column of the scan."""
    from matplotlib.figure import Figure

    fitted = subject.parameters(column) is not None
    rows = subject.rows(theta_i)
    rows = rows[subject.scan.theta_r[rows] < 90.0]
    if len(rows) > MOST_POINTS:
        rows = rows[np.linspace(0, len(rows) - 1, MOST_POINTS).astype(np.intp)]
    rows = rows[~subject.scan.mask[rows, column]]
    figure = Figure(figsize=(10.5, 7.0), layout="constrained")
    grid = figure.add_gridspec(2, 6, height_ratios=(1.1, 1.0))
    maps = [figure.add_subplot(grid[0, 2 * k : 2 * k + 2]) for k in range(3 if fitted else 1)]
    _maps(figure, maps, subject, theta_i, column, rows)
    _cut(figure.add_subplot(grid[1, :3]), subject, theta_i, column, rows)
    _spectrum(figure.add_subplot(grid[1, 3:]), subject, theta_i)
    return figure


def _on_disc(theta_r: npt.ArrayLike, phi: npt.ArrayLike) -> tuple[Array, Array]:
    """Lambert's azimuthal equal-area projection about the normal: x forward, on the unit disc."""
    r = np.sin(np.deg2rad(theta_r) / 2.0) / np.sin(np.pi / 4.0)
    return -r * np.cos(np.deg2rad(phi)), r * np.sin(np.deg2rad(phi))


def _maps(
    figure: Figure,
    axes: list[Axes],
    subject: Subject,
    theta_i: float,
    column: int,
    rows: npt.NDArray[np.intp],
) -> None:
    from matplotlib.colors import LogNorm, Normalize

    scan = subject.scan
    measured = scan.brdf[rows, column]
    x, y = _on_disc(scan.theta_r[rows], scan.phi[rows])
    good = measured[measured > 0.0]
    low, high = (float(good.min()), float(good.max())) if good.size else (0.1, 1.0)
    wide = high > WIDE_RANGE * low
    norm = LogNorm(low, high) if wide else Normalize(low, high)
    size = float(np.clip(9000.0 / max(1, len(rows)), 4.0, 60.0))
    shown = axes[0].scatter(x, y, c=measured, s=size, norm=norm, cmap=VALUE_MAP, linewidths=0)
    axes[0].set_title("measured", fontsize=10)
    figure.colorbar(shown, ax=axes[0], label="BRDF (1/sr)", location="bottom", shrink=0.8)
    if len(axes) > 1:
        side = np.linspace(-1.0, 1.0, 181)
        gx, gy = np.meshgrid(side, side)
        r = np.hypot(gx, gy)
        theta_r = np.rad2deg(2.0 * np.arcsin(np.minimum(r, 1.0) * np.sin(np.pi / 4.0)))
        inside = r < 0.999
        where = subject.directions(
            [theta_i], theta_r[inside], np.rad2deg(np.arctan2(gy, -gx))[inside] % 360.0
        )
        field = np.full(gx.shape, np.nan)
        field[inside] = subject.model_values(column, where)
        image = axes[1].imshow(field, extent=(-1, 1, -1, 1), origin="lower", norm=norm, cmap=VALUE_MAP)
        axes[1].set_title("model", fontsize=10)
        figure.colorbar(image, ax=axes[1], label="BRDF (1/sr)", location="bottom", shrink=0.8)
        model = subject.seen_values(column, rows)
        gap = 100.0 * (measured - model) / measured
        limit = float(np.percentile(np.abs(gap), 98.0)) if len(gap) else 1.0
        left = axes[2].scatter(
            x, y, c=gap, s=size, vmin=-limit or -1.0, vmax=limit or 1.0, cmap=DIFFERENCE_MAP, linewidths=0
        )
        axes[2].set_title("residual", fontsize=10)
        label = f"(measured − {'seen' if subject.sees else 'model'}) / measured (%)"
        figure.colorbar(left, ax=axes[2], label=label, location="bottom", shrink=0.8)
    around = np.linspace(0.0, 360.0, 181)
    if len(axes) > 1:
        axes[1].plot(*_on_disc(subject.reach(theta_i), around), color="white", linewidth=1.0, linestyle=":")
    for one in axes:
        for ring in (30.0, 60.0, 90.0):
            one.plot(*_on_disc(ring, around), color=BLACK if ring == 90.0 else GREY, linewidth=0.7)
        one.plot(*_on_disc(theta_i, 180.0), "s", markerfacecolor="none", color=BLACK, markersize=6)
        one.set_aspect("equal")
        one.set_axis_off()


def _cut(axes: Axes, subject: Subject, theta_i: float, column: int, rows: npt.NDArray[np.intp]) -> None:
    scan = subject.scan
    away = np.abs(scan.phi[rows] - 180.0)
    forward, back = (away <= 1.0) | (scan.theta_r[rows] == 0.0), away >= 179.0
    here = forward | back
    zenith = np.where(forward, 1.0, -1.0)[here] * scan.theta_r[rows[here]]
    sigma = None if scan.sigma is None else np.nan_to_num(scan.sigma[rows[here], column])
    values = scan.brdf[rows[here], column]
    axes.errorbar(zenith, values, sigma, fmt="o", markersize=2.5, color=BLACK, elinewidth=0.7)
    if subject.parameters(column) is not None:
        fine = np.sort(np.append(np.linspace(-85.0, 85.0, 341), theta_i + np.linspace(-3.0, 3.0, 61)))
        side = np.where(fine < 0.0, 0.0, 180.0)
        assert subject.fit is not None
        model = seen_along(subject.fit, subject.directions([theta_i], np.abs(fine), side), column)
        inside = np.abs(fine) <= subject.reach(theta_i)
        axes.plot(fine[inside], model[inside], color=BLUE, linewidth=1.2)
        values = np.append(values, model[inside])
    good = values[np.isfinite(values) & (values > 0.0)]
    if good.size and good.max() > WIDE_RANGE * good.min():
        axes.set_yscale("log")
    axes.set_xlabel("θr (°), forward positive")
    axes.set_ylabel("BRDF (1/sr)")
    axes.grid(alpha=0.25)


def _spectrum(axes: Axes, subject: Subject, theta_i: float) -> None:
    scan, rows = subject.scan, subject.rows(theta_i)
    if not len(rows):
        axes.set_axis_off()
        return
    gap = _separation(scan.theta_r[rows], scan.phi[rows], theta_i, 180.0)
    n = rows[gap.argmin()]
    good = ~scan.mask[n]
    x = subject.wavelength
    sigma = None if scan.sigma is None else np.nan_to_num(scan.sigma[n])[good]
    axes.errorbar(x[good], scan.brdf[n, good], sigma, fmt="o", markersize=2.5, color=BLACK, elinewidth=0.7)
    if subject.fit is not None:
        values = subject.seen_spectrum(int(n))
        axes.plot(x, values, color=BLUE, linewidth=1.2)
    axes.set_title(f"θr = {scan.theta_r[n]:g}°, φ = {scan.phi[n]:g}°", fontsize=10)
    axes.set_xlabel("band" if scan.bands else "wavelength (nm)")
    axes.set_ylabel("BRDF (1/sr)")
    axes.grid(alpha=0.25)


def _separation(theta1: Array, phi1: Array, theta2: float, phi2: float) -> Array:
    """Angle between directions, rad."""
    t1, t2, turn = np.deg2rad(theta1), np.deg2rad(theta2), np.deg2rad(phi1 - phi2)
    return np.asarray(
        np.arccos(np.clip(np.cos(t1) * np.cos(t2) + np.sin(t1) * np.sin(t2) * np.cos(turn), -1.0, 1.0))
    )


def _png(figure: Figure) -> bytes:
    from PIL import Image

    whole, out = io.BytesIO(), io.BytesIO()
    figure.savefig(whole, format="png", dpi=DPI)
    whole.seek(0)
    flat = Image.open(whole).convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
    flat.save(out, format="PNG", optimize=True)
    return out.getvalue()
