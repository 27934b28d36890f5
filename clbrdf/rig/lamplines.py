"""Wavelength correction from the lines of a lamp.

Source: NIST Atomic Spectra Database, observed wavelengths in air, nm: strong lines that stand alone at the
resolution of a small spectrometer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.rig.errors import UnmendedError

Array = npt.NDArray[np.float64]

LINES = {
    "Hg": (404.656, 435.833, 546.074),
    "Ar": (696.543, 763.511, 811.531),
    "Ne": (585.249, 614.306, 640.225, 703.241, 724.517),
    "Kr": (557.029, 587.092, 760.155, 811.290),
}
"""By element."""

MIDDLE = 550.0
"""About which the slope of a correction turns, nm."""

REACH = 5.0
"""How far from its place a line is looked for, nm."""

LEAST_SIGMAS = 10.0


@dataclass(frozen=True)
class SpectralLine:
    """One line: where it is, where it was found, and the standard uncertainty of that, nm."""

    true: float
    found: float
    sigma: float


@dataclass(frozen=True)
class Correction:
    """What to add to the wavelengths of a spectrometer: offset + slope · (λ − 550 nm).

    Attributes
    ----------
    offset, slope : float
        nm and nm/nm; the slope is 0 with fewer than three lines.
    offset_sigma, slope_sigma : float
        Standard uncertainties.
    lines : tuple of SpectralLine
    """

    offset: float
    slope: float
    offset_sigma: float
    slope_sigma: float
    lines: tuple[SpectralLine, ...]


def corrected(wavelength: Array, correction: Sequence[float]) -> Array:
    """Return wavelengths, nm, with a correction (offset, slope) added; () changes nothing."""
    offset, slope = (*correction, 0.0, 0.0)[:2]
    return np.asarray(wavelength + offset + slope * (wavelength - MIDDLE), dtype=np.float64)


def find_correction(
    wavelength: Array, spectrum: Array, variance: Array, elements: Sequence[str]
) -> Correction:
    """Find lines of a lamp in a spectrum and return the correction that puts them in their places.

    Parameters
    ----------
    wavelength : (P,) float64
        As the spectrometer says, nm.
    spectrum, variance : (P,) float64
        Net signal and its variance.
    elements : sequence of str
        In the lamp, of `LINES`.

    Raises
    ------
    UnmendedError
        An element without lines here, or no line found.
    """
    unknown = [element for element in elements if element not in LINES]
    if unknown:
        raise UnmendedError(f"no lines of {', '.join(unknown)} are known here; there are {', '.join(LINES)}")
    wanted = sorted(line for element in elements for line in LINES[element])
    lines = [_find(line, wavelength, spectrum, variance) for line in wanted]
    found = tuple(line for line in lines if line is not None)
    if not found:
        raise UnmendedError(
            f"none of the lines of {', '.join(elements)} stands out between {wavelength[0]:.0f} and"
            f" {wavelength[-1]:.0f} nm; is it that lamp that shines?"
        )
    x = np.array([line.found for line in found]) - MIDDLE
    y = np.array([line.true - line.found for line in found])
    weight = 1.0 / np.array([line.sigma for line in found])
    columns = np.stack([np.ones_like(x), x], axis=1)[:, : 2 if len(found) > 2 else 1]
    solution, *_ = np.linalg.lstsq(columns * weight[:, None], y * weight, rcond=None)
    covariance = np.linalg.inv((columns * weight[:, None]).T @ (columns * weight[:, None]))
    residual = (y - columns @ solution) * weight
    freedom = len(found) - len(solution)
    excess = max(1.0, float((residual**2).sum() / freedom)) if freedom else 1.0
    sigmas = np.sqrt(np.diag(covariance) * excess)
    slope, slope_sigma = (float(solution[1]), float(sigmas[1])) if len(solution) > 1 else (0.0, 0.0)
    return Correction(float(solution[0]), slope, float(sigmas[0]), slope_sigma, found)


def _find(true: float, wavelength: Array, spectrum: Array, variance: Array) -> SpectralLine | None:
    """Return the line nearest to its place: the centroid of its upper part; None where none stands out."""
    near = np.nonzero(np.abs(wavelength - true) <= REACH)[0]
    if len(near) < 5:
        return None
    top = near[int(np.argmax(spectrum[near]))]
    floor = float(np.median(spectrum[near]))
    height = float(spectrum[top]) - floor
    if not height > LEAST_SIGMAS * float(np.sqrt(variance[top])) or top in (near[0], near[-1]):
        return None
    low = high = int(top)
    while low > near[0] and spectrum[low - 1] - floor > 0.2 * height:
        low -= 1
    while high < near[-1] and spectrum[high + 1] - floor > 0.2 * height:
        high += 1
    part = slice(low, high + 1)
    light = spectrum[part] - floor
    centre = float((wavelength[part] * light).sum() / light.sum())
    spread = ((wavelength[part] - centre) ** 2 * variance[part]).sum()
    pixel = float(np.gradient(wavelength)[top])
    # A centroid of few pixels is off by a few hundredths of one, depending on where the line falls.
    return SpectralLine(true, centre, float(np.hypot(np.sqrt(spread) / light.sum(), 0.03 * pixel)))
