"""Does the model describe the data? χ², neighbours along θr, and lack of fit against repeats.

χ² = Σ ((m − f)/σ)² over its degrees of freedom ν = N − P is near 1 where the model and the uncertainties of
the scan are right. Without uncertainties there is none, and two tests remain that need no scale. Where the
same direction was measured again, the deviations divide into those of the values from their mean (pure
error) and those of the mean from the model, and

    F = [(Σ g r² − pure) / (ν − ν_pure)] / [pure / ν_pure]

is near 1. And noise has no memory: with z = √g r at neighbours along a line of view angles, products z z′ of
independent errors are positive as often as negative, whatever their sizes. Given the sizes,

    t = Σ z z′ / √Σ (z z′)²

then exceeds any t > 0 with a probability of at most exp(−t²/2) (Hoeffding). Neighbours are compared by z and
not by sign, since a fit that gives small values little weight may leave all of them on one side.

Sources: Bevington and Robinson, Data Reduction and Error Analysis (3rd ed., 2003), chapter 11; Draper and
Smith, Applied Regression Analysis (3rd ed., 1998), section 2.1 (lack of fit); Hoeffding, J. Am. Stat. Assoc.
58 (1963), doi:10.1080/01621459.1963.10500830.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.fit.lines import view_lines
from clbrdf.fit.records import Goodness, Mask, Setup
from clbrdf.scan import Scan
from clbrdf.scan.rectangle import group_numbers

Array = npt.NDArray[np.float64]
Count = npt.NDArray[np.int64]

EXACT = 1e-20
"""E up to which deviations are rounding, and have neither sign nor scatter that means anything."""

DOUBT = 1e-4
"""Probability below which chance is no explanation: of 100 wavelengths, three tests each, one in thirty scans
is then blamed without reason."""

SAME_VALUE = 1e-12
"""Relative to the measured values: repeats nearer than this are copies, and their scatter says nothing."""


BLOCK_VALUES = 1 << 17
"""Values that are looked at at once."""


def deviation_tests(
    scan: Scan,
    setup: Setup,
    at_bound: Mask,
    energy: Array,
    values_of: Callable[[npt.NDArray[np.intp]], Array],
) -> dict[str, Any]:
    """Return what `Goodness` says beyond E and σ_r, as its fields by name, each (W,).

    Parameters
    ----------
    scan : Scan
        N directions, W wavelengths.
    setup : Setup
    at_bound : (W, P) bool
        Parameters at a limit.
    energy : (W,) float64
        E of (13).
    values_of : callable
        Places (B,) of wavelengths that were fitted -> model values (B, N), 1/sr.
    """
    wavelengths = len(scan.wavelength)
    lines = view_lines(scan.directions)
    angles = np.stack([scan.theta_i, scan.phi_i, scan.theta_r, scan.phi_r], axis=1)
    group = group_numbers(angles)
    copies = group if int(group.max(initial=-1)) + 1 < len(group) else None
    free = free_parameters(setup, at_bound)
    names = ("degrees", "chi2_reduced", "scatter", "lag_one", "lag_score", "lack_of_fit")
    out: dict[str, Any] = {name: np.full(wavelengths, np.nan) for name in names}
    out["repeats"] = np.zeros(wavelengths, dtype=np.int64)
    size = max(1, BLOCK_VALUES // max(1, len(scan)))
    fitted = setup.fitted
    waiting: list[tuple[npt.NDArray[np.intp], Future[dict[str, Any]]]] = []

    def settle(most: int) -> None:
        while len(waiting) > most:
            places, told = waiting.pop(0)
            for name, values in told.result().items():
                out[name][places] = values

    with ThreadPoolExecutor(1) as thread:  # while it judges, the device forms the next values
        for first in range(0, len(fitted), size):
            places = fitted[first : first + size]
            known = free[places], energy[places], values_of(places)
            waiting.append((places, thread.submit(_tests, scan, setup, places, *known, lines, copies)))
            settle(1)
        settle(0)
    return out


def _tests(
    scan: Scan,
    setup: Setup,
    places: npt.NDArray[np.intp],
    free: Array,
    energy: Array,
    values: Array,
    lines: list[npt.NDArray[np.intp]],
    copies: npt.NDArray[np.intp] | None,
) -> dict[str, Any]:
    """As `deviation_tests`, of some wavelengths; arrays are (B, N), so that sums do not depend on B."""
    g = np.ascontiguousarray(setup.weights[:, places].T)
    used = g > 0.0
    measured = np.where(used, scan.brdf[:, places].T, 0.0)
    deviation = np.where(used, measured - values, 0.0)
    count = used.sum(axis=1)
    degrees = count - free
    judged = (degrees > 0.0) & (count > 0)
    chi2 = np.full(len(places), np.nan)
    # An uncertainty of next to nothing makes χ² infinite.
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        if scan.sigma is not None:
            sigma = scan.sigma[:, places].T
            known = (sigma > 0.0) | ~used
            square = ((deviation / np.where(used & known, sigma, 1.0)) ** 2).sum(axis=1)
            chi2 = np.where(judged & known.all(axis=1), square / degrees, np.nan)
        scatter = np.where(judged, np.sqrt((g * deviation**2).sum(axis=1) / degrees), np.nan)
    real = (energy > EXACT)[:, None]
    scaled = np.sqrt(g / g.max(axis=1, initial=1e-300)[:, None]) * deviation
    correlation, score = neighbour_correlation(lines, scaled, used & real)
    ratio, repeats = lack_of_fit(copies, g * real, deviation, measured, degrees)
    return {
        "degrees": np.where(count > 0, degrees, np.nan),
        "chi2_reduced": chi2,
        "scatter": scatter,
        "lag_one": correlation,
        "lag_score": score,
        "lack_of_fit": ratio,
        "repeats": repeats,
    }


def misfit(found: Goodness) -> Mask:
    """Return where the model does not describe the data, (W,): by χ², or by the scatter of repeats."""
    from scipy.special import chdtrc, fdtrc

    chi2, ratio = np.nan_to_num(found.chi2_reduced), np.nan_to_num(found.lack_of_fit)
    degrees = np.where(found.degrees > 0.0, found.degrees, 1.0)
    rest, repeats = np.maximum(degrees - found.repeats, 1.0), np.maximum(found.repeats, 1)
    with np.errstate(over="ignore"):
        by_chi2 = chdtrc(degrees, degrees * chi2) < DOUBT
    by_repeats = fdtrc(rest, repeats, ratio) < DOUBT
    return np.asarray((by_chi2 & (chi2 > 1.0)) | (by_repeats & (ratio > 1.0)))


def overstated(found: Goodness) -> Mask:
    """Return where deviations are smaller than the scan's uncertainties allow by chance, (W,)."""
    from scipy.special import chdtr

    chi2 = np.where(np.isfinite(found.chi2_reduced), found.chi2_reduced, np.inf)
    degrees = np.where(found.degrees > 0.0, found.degrees, 1.0)
    return np.asarray((chi2 < 1.0) & (chdtr(degrees, degrees * np.minimum(chi2, 1.0)) < DOUBT))


def neighbours_agree(score: Array) -> Mask:
    """Return where t of neighbours is no chance, (W,)."""
    return np.asarray(np.nan_to_num(score) > np.sqrt(-2.0 * np.log(DOUBT)))


def free_parameters(setup: Setup, at_bound: Mask) -> Array:
    """Return how many parameters each wavelength has taken from its values, (W,).

    A shared one counts as its part of one; one at its limit is not fitted.
    """
    own = at_bound.shape[1] - len(setup.fixed) - len(setup.shared)
    free = own + len(setup.shared) / max(1, len(setup.fitted))
    return np.asarray(np.maximum(free - at_bound.sum(axis=1), 0.0))


def neighbour_correlation(lines: list[npt.NDArray[np.intp]], z: Array, used: Mask) -> tuple[Array, Array]:
    """Return the correlation of neighbours on lines of view, and its t, both (B,); NaN without neighbours.

    Parameters
    ----------
    lines : list of int arrays
        `view_lines` of the N directions.
    z : (B, N) float64
        √g times the deviation.
    used : (B, N) bool
        Values that are not used are left out, and those beside them become neighbours.
    """
    correlation, score = np.full((2, len(z)), np.nan)
    if not lines:
        return correlation, score
    order, line = np.concatenate(lines), np.repeat(np.arange(len(lines)), [len(part) for part in lines])
    if used[:, order].all():  # as usual: all at once
        along, same = z[:, order], np.flatnonzero(line[1:] == line[:-1])
        product = along[:, same + 1] * along[:, same]
        square = (product**2).sum(axis=1)
        told = square > 0.0
        mean, size = product.mean(axis=1), (along**2).mean(axis=1)
        np.divide(mean, size, out=correlation, where=told)
        np.divide(product.sum(axis=1), np.sqrt(square), out=score, where=told)
        return correlation, score
    for k in range(len(z)):
        here = used[k, order]
        along, number = z[k, order[here]], line[here]
        product = (along[1:] * along[:-1])[number[1:] == number[:-1]]
        square = (product**2).sum()
        if square > 0.0:
            correlation[k] = product.mean() / (along**2).mean()
            score[k] = product.sum() / np.sqrt(square)
    return correlation, score


def lack_of_fit(
    copies: npt.NDArray[np.intp] | None, weights: Array, deviation: Array, measured: Array, degrees: Array
) -> tuple[Array, Count]:
    """Return F (B,), NaN where no direction was measured again, and the degrees of freedom of repeats.

    Parameters
    ----------
    copies : (N,) int or None
        Number of each different direction; None where all differ.
    weights, deviation, measured : (B, N) float64
    degrees : (B,) float64
    """
    if copies is None:
        return np.full(len(degrees), np.nan), np.zeros(len(degrees), dtype=np.int64)
    size = int(copies.max()) + 1

    def total(values: Array) -> Array:
        return np.stack([np.bincount(copies, row, size) for row in values])

    g = total(weights)
    mean = total(weights * deviation) / np.where(g > 0.0, g, 1.0)
    pure = (weights * (deviation - mean[:, copies]) ** 2).sum(axis=1)
    repeats = (weights > 0.0).sum(axis=1) - (g > 0.0).sum(axis=1)
    rest = (weights * deviation**2).sum(axis=1) - pure
    square = (weights * measured**2).sum(axis=1)
    told = (repeats > 0) & (degrees > repeats) & (pure > SAME_VALUE**2 * square)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = (rest / (degrees - repeats)) / (pure / repeats)
    return np.where(told, np.maximum(ratio, 0.0), np.nan), repeats.astype(np.int64)
