"""Whether what an instrument says can be true: coefficients, a direct beam, a dark spectrum."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clbrdf.rig.errors import UnmendedError
from clbrdf.rig.rigfile import SpectrometerSettings
from clbrdf.rig.uncertainty import count_variance

Array = npt.NDArray[np.float64]


def check_wavelengths(wavelength: Array) -> None:
    """Raise UnmendedError where the wavelengths of the pixels (P,), nm, cannot be."""
    if not np.isfinite(wavelength).all():
        raise UnmendedError(
            "spectrometer: its wavelength coefficients give values that are no numbers; write them into"
            " the spectrometer again with its maker's program"
        )
    if (np.diff(wavelength) <= 0.0).any() or wavelength.min() <= 0.0:
        raise UnmendedError(
            f"spectrometer: its wavelengths do not rise from pixel to pixel ({wavelength.min():.4g} to"
            f" {wavelength.max():.4g} nm); write its coefficients again with its maker's program"
        )


def check_nonlinearity(coefficients: Array, full_scale: float) -> None:
    """Raise UnmendedError where the nonlinearity polynomial cannot divide counts up to full scale."""
    if not len(coefficients):
        return
    if not np.isfinite(coefficients).all():
        raise UnmendedError(
            "spectrometer: its nonlinearity coefficients are no numbers; write them into the spectrometer"
            " again with its maker's program"
        )
    values = np.polynomial.Polynomial(coefficients)(np.linspace(0.0, full_scale, 257))
    if values.min() < 0.2 or values.max() > 5.0:
        raise UnmendedError(
            f"spectrometer: its nonlinearity polynomial runs from {values.min():.3g} to {values.max():.3g}"
            " up to full scale, where about 1 is meant; write its coefficients again"
        )


def signal_to_noise(light: Array, dark: Array, scans: int, settings: SpectrometerSettings) -> float:
    """Return the median over pixels (P,) of net counts per scan over their standard deviation."""
    variance = (count_variance(light, settings) + count_variance(dark, settings)) / scans
    return float(np.median((light - dark) / np.sqrt(np.maximum(variance, 1e-12))))


def is_below_dark(light: Array, dark: Array, scans: int, settings: SpectrometerSettings) -> bool:
    """Say whether a spectrum (P,), counts per scan, is darker than its dark: the shutter did not obey."""
    variance = (count_variance(light, settings) + count_variance(dark, settings)).sum() / scans
    deficit = float((dark - light).sum())
    return deficit > 6.0 * float(np.sqrt(variance)) + 1.0 * light.size
