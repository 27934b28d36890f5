"""What the residuals of a fit look like: along θr, at each θi, and in words.

Noise has no memory: along a line of view angles a residual has the sign of its neighbour half of the time.
A misfit has one: it is positive here and negative there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.choose.angles import AngleGroups
from clbrdf.fit.lines import view_lines
from clbrdf.geometry import sin2_gamma, trigonometry
from clbrdf.scan import Scan

Array = npt.NDArray[np.float64]

NEAR_MIRROR = 10.0
"""Degrees from the mirror direction within which words speak of it."""

MOST_PLACES = 3
"""Of those where a model misses the most."""


@dataclass(frozen=True)
class Misfit:
    """Where a model misses the data.

    Attributes
    ----------
    theta_i : float
        Degrees.
    region : str
    deviation, spread : float
        Weighted mean of (model − measured), relative to the measured values there, and the root mean square.
    share : float
        Of Σ g r² over all directions and wavelengths.
    """

    theta_i: float
    region: str
    deviation: float
    spread: float
    share: float

    def words(self) -> str:
        """Return one line: which angle, which sign, what size."""
        side = "above" if self.deviation > 0.0 else "below"
        return (
            f"θi = {self.theta_i:.3g}°, {self.region}: deviations of {100 * self.spread:.2g} %, on average"
            f" {100 * abs(self.deviation):.2g} % {side} the measured values"
            f" ({100 * self.share:.0f} % of Σ g r²)"
        )


def lag_one_correlation(scan: Scan, scaled: Array) -> float:
    """Return the correlation of neighbouring residuals along θr; NaN where no line of them is measured.

    Parameters
    ----------
    scan : Scan
        N directions × W wavelengths.
    scaled : (N, W) float64
        √g (f_model − f), NaN where a value is not used. Every wavelength counts the same.

    Returns
    -------
    float
        Near 0 for noise, towards 1 for a smooth misfit.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        unit = scaled / np.sqrt(np.nanmean(scaled**2, axis=0))
    product, square, pairs, values = 0.0, 0.0, 0, 0
    for line in view_lines(scan.directions):
        z = unit[line]
        both = z[1:] * z[:-1]
        product += float(np.nansum(both))
        pairs += int(np.count_nonzero(np.isfinite(both)))
        square += float(np.nansum(z**2))
        values += int(np.count_nonzero(np.isfinite(z)))
    return (product / pairs) / (square / values) if pairs and square > 0.0 else float("nan")


def mean_residuals(scan: Scan, weights: Array, model_values: Array, groups: AngleGroups) -> Array:
    """Return Σ g f (f_model − f) / Σ g f² at each incident angle, (I,), all wavelengths together.

    With relative weights it is the mean relative deviation. Positive: the model lies above the data. Every
    wavelength counts the same; NaN where nothing was measured.
    """
    out = [_deviation(scan, weights, model_values, groups.group == k)[0] for k in range(len(groups.theta_i))]
    return np.array(out)


def _deviation(
    scan: Scan, weights: Array, model_values: Array, rows: npt.NDArray[np.bool_]
) -> tuple[float, float]:
    """Return the relative mean and root mean square of (model − measured) in some directions."""
    g = weights[rows]
    f = np.where(g > 0.0, scan.brdf[rows], 0.0)
    r = np.where(g > 0.0, model_values[rows] - f, 0.0)
    norm = (g * f * f).sum(axis=0)
    good = norm > 0.0
    if not good.any():
        return float("nan"), float("nan")
    mean = (g * f * r).sum(axis=0)[good] / norm[good]
    square = (g * r * r).sum(axis=0)[good] / norm[good]
    return float(mean.mean()), float(np.sqrt(square.mean()))


def worst_places(
    scan: Scan, weights: Array, model_values: Array, groups: AngleGroups, most: int = MOST_PLACES
) -> tuple[Misfit, ...]:
    """Return where a model misses the data most, by its share of Σ g r², each wavelength scaled to 1."""
    square = np.where(weights > 0.0, weights * (model_values - scan.brdf) ** 2, 0.0)
    total = square.sum(axis=0)
    shares = np.divide(square, total, out=np.zeros_like(square), where=total > 0.0)
    shares /= max(1, np.count_nonzero(total > 0.0))
    regions = view_regions(scan)
    found = []
    for k, angle in enumerate(groups.theta_i):
        for name in dict.fromkeys(regions[groups.group == k].tolist()):
            rows = (groups.group == k) & (regions == name)
            share = float(shares[rows].sum())
            if share > 0.0:
                mean, spread = _deviation(scan, weights, model_values, rows)
                found.append(Misfit(float(angle), name, mean, spread, share))
    return tuple(sorted(found, key=lambda place: -place.share)[:most])


def view_regions(scan: Scan) -> npt.NDArray[np.str_]:
    """Name the region of each view direction, (N,): near the mirror direction, or on which side of it."""
    t = trigonometry(scan.directions)
    from_mirror = np.rad2deg(2.0 * np.arcsin(np.sqrt(np.clip(sin2_gamma(t), 0.0, 1.0))))
    forward = (np.cos(np.deg2rad(scan.phi)) < 0.0) & (scan.theta_r > 0.0)
    beyond = scan.theta_r > scan.theta_i
    ahead = np.where(beyond, "forward, nearer to grazing", "forward, nearer to the normal")
    return np.where(
        from_mirror <= NEAR_MIRROR,
        f"within {NEAR_MIRROR:g}° of the mirror direction",
        np.where(forward, ahead, "on the source's side or beside it"),
    )
