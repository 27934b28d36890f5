"""The colour that a spectrum of reflectance has for the CIE 1931 2° observer under a named illuminant.

XYZ by summation at 5 nm (CIE 15:2004, 7.1), white Y = 1; sRGB of IEC 61966-2-1:1999. A picture under
another light than daylight is adapted to white by the Bradford transform (ICC.1:2010, annex E), as the
eye does, so that a white surface is white under each.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from clbrdf.colour import cie
from clbrdf.errors import InputError

Array = npt.NDArray[np.float64]

ILLUMINANTS: Mapping[str, Array] = MappingProxyType(
    {
        "D65": cie.D65,
        "D50": cie.D50,
        "A": cie.A,
        "E": cie.EQUAL_ENERGY,
        "FL2": cie.FL2,
        "FL11": cie.FL11,
    }
)
"""Relative spectral power on `cie.WAVELENGTH`: daylights, incandescent, equal energy, fluorescent."""

DEFAULT_ILLUMINANT = "D65"

# Linear sRGB of XYZ with white Y = 1.
XYZ_TO_RGB = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])

BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])

FIRST_NEEDED, LAST_NEEDED, LARGEST_STEP = 460.0, 620.0, 60.0
"""A spectrum that ends before these, or with larger steps (nm), does not determine a colour."""

SPECTRUM = "take a spectrum that goes so far"
"""What to do about wavelengths that do not determine a colour, where nothing better is known."""


def get_illuminant(name: str) -> Array:
    """Return the relative spectral power of an illuminant on `cie.WAVELENGTH`, (81,).

    Raises
    ------
    InputError
        An unknown name.
    """
    known = name.strip().upper()
    if known not in ILLUMINANTS:
        raise InputError(f"illuminant {name!r} is not known; choose one of {', '.join(ILLUMINANTS)}")
    return ILLUMINANTS[known]


def check_spectrum(wavelength: Array, mend: str = SPECTRUM) -> None:
    """Raise InputError, which ends with `mend`, where wavelengths (W,) in nm do not determine a colour."""
    inside = wavelength[(wavelength >= 360.0) & (wavelength <= 800.0)]
    if (
        len(inside) < 3
        or inside[0] > FIRST_NEEDED
        or inside[-1] < LAST_NEEDED
        or np.diff(inside).max() > LARGEST_STEP
    ):
        there = f"{wavelength[0]:g}" if len(wavelength) == 1 else f"{wavelength[0]:g} to {wavelength[-1]:g}"
        raise InputError(
            f"a colour needs a spectrum from {FIRST_NEEDED:g} to {LAST_NEEDED:g} nm in steps of at most"
            f" {LARGEST_STEP:g} nm, and this has {len(wavelength)} at {there} nm; {mend}"
        )


def colour_weights(wavelength: Array, illuminant: str = DEFAULT_ILLUMINANT, mend: str = SPECTRUM) -> Array:
    """Weights (3, W) that take a reflectance spectrum on wavelengths (nm) to X, Y, Z with white Y = 1.

    The spectrum is taken as linear between its wavelengths and constant beyond its ends.

    Raises
    ------
    InputError
        The wavelengths do not determine a colour, or the illuminant is not known.
    """
    power = get_illuminant(illuminant)
    check_spectrum(wavelength, mend)
    light = power * np.array([cie.X_BAR, cie.Y_BAR, cie.Z_BAR])
    light /= light[1].sum()
    # Each wavelength's share is the hat function of linear interpolation.
    hats = np.array([np.interp(cie.WAVELENGTH, wavelength, row) for row in np.eye(len(wavelength))])
    return np.asarray(light @ hats.T)


def rgb_weights(wavelength: Array, illuminant: str = DEFAULT_ILLUMINANT, mend: str = SPECTRUM) -> Array:
    """Weights (3, W) that take a reflectance spectrum to linear sRGB; a spectrum of ones gives (1, 1, 1).

    Raises
    ------
    InputError
        As `colour_weights`.
    """
    xyz = colour_weights(wavelength, illuminant, mend)
    here = BRADFORD @ xyz.sum(axis=1)
    there = BRADFORD @ np.linalg.solve(XYZ_TO_RGB, np.ones(3))
    adapted = np.linalg.solve(BRADFORD, (there / here)[:, None] * (BRADFORD @ xyz))
    return np.asarray(XYZ_TO_RGB @ adapted)


def encode_srgb(linear: Array) -> Array:
    """Encode linear sRGB, [0, 1]; values outside are cut off."""
    values = np.clip(linear, 0.0, 1.0)
    return np.where(values <= 0.0031308, 12.92 * values, 1.055 * values ** (1.0 / 2.4) - 0.055)
