"""The colour a reflectance spectrum has in daylight: CIE 1931 2° observer, illuminant D65, to sRGB.

Colour matching functions: the piecewise Gaussian fits of C. Wyman, P.-P. Sloan and P. Shirley, "Simple
analytic approximations to the CIE XYZ color matching functions", J. Comput. Graph. Tech. 2(2), 2013,
1–11, the multi-lobe fit. Against the CIE table at 10 nm (tests/viz/test_colour.py) the fits stay within
0.011 (x̄), 0.008 (ȳ) and 0.013 (z̄) where the functions peak at 1.06, 1.0 and 1.78; a flat spectrum comes out
within 0.002 of the chromaticity of D65.

D65: relative spectral power, CIE 15:2004, table T.1, every 10 nm, linear between.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError

Array = npt.NDArray[np.float64]

# Amplitude, centre (nm), widths below and above the centre (nm), for x̄, ȳ and z̄.
LOBES = (
    ((1.056, 599.8, 37.9, 31.0), (0.362, 442.0, 16.0, 26.7), (-0.065, 501.1, 20.4, 26.2)),
    ((0.821, 568.8, 46.9, 40.5), (0.286, 530.9, 16.3, 31.1)),
    ((1.217, 437.0, 11.8, 36.0), (0.681, 459.0, 26.0, 13.8)),
)

D65_WAVELENGTH = np.arange(380.0, 781.0, 10.0)
D65 = np.fromstring(
    """
    49.9755 54.6482 82.7549 91.486 93.4318 86.6823 104.865 117.008 117.812 114.861
    115.923 108.811 109.354 107.802 104.79 107.689 104.405 104.046 100.0 96.3342
    95.788 88.6856 90.0062 89.5991 87.6987 83.2886 83.6992 80.0268 80.2146 82.2778
    78.2842 69.7213 71.6091 74.349 61.604 69.8856 75.087 63.5927 46.4182 66.8054 63.3828
    """,
    sep=" ",
)

ILLUMINANTS = ("D65", "A")
"""Daylight and incandescent light."""


def illuminant(name: str, wavelength: npt.ArrayLike) -> Array:
    """Relative spectral power of D65 or A at wavelengths in nm.

    A is Planck's law for 2848 K with c2 = 1.435e7 nm K, CIE 15:2004, 3.1.
    """
    nm = np.asarray(wavelength, dtype=np.float64)
    if name == "D65":
        return np.interp(nm, D65_WAVELENGTH, D65)
    across = np.expm1(1.435e7 / (2848.0 * 560.0)) / np.expm1(1.435e7 / (2848.0 * nm))
    return np.asarray(100.0 * (560.0 / nm) ** 5 * across)


# IEC 61966-2-1:1999, linear sRGB of XYZ with white Y = 1.
XYZ_TO_RGB = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])

FIRST_NEEDED, LAST_NEEDED, LARGEST_STEP = 460.0, 620.0, 60.0
"""A spectrum that ends before these, or with larger steps (nm), does not determine a colour."""


def matching_functions(wavelength: npt.ArrayLike) -> Array:
    """x̄, ȳ, z̄ of the CIE 1931 2° observer at wavelengths (W,) in nm, (3, W)."""
    nm = np.asarray(wavelength, dtype=np.float64)
    rows = []
    for lobes in LOBES:
        total = np.zeros_like(nm)
        for amplitude, centre, below, above in lobes:
            width = np.where(nm < centre, below, above)
            total += amplitude * np.exp(-0.5 * ((nm - centre) / width) ** 2)
        rows.append(total)
    return np.array(rows)


def check_spectrum(wavelength: Array) -> None:
    """Raise InputError where wavelengths (W,) in nm do not determine a colour."""
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
            f" {LARGEST_STEP:g} nm, and this has {len(wavelength)} at {there} nm; colour by value instead"
        )


def colour_weights(wavelength: Array, light: str = "D65") -> Array:
    """Weights (3, W) that take a reflectance spectrum on wavelengths (nm) to X, Y, Z with white Y = 1.

    The spectrum is taken as linear between its wavelengths and constant beyond its ends; `light` is one of
    ILLUMINANTS.

    Raises
    ------
    InputError
        The wavelengths do not determine a colour.
    """
    check_spectrum(wavelength)
    fine = np.arange(380.0, 781.0, 1.0)
    seen = illuminant(light, fine) * matching_functions(fine)
    seen /= seen[1].sum()
    # Each wavelength's share is the hat function of linear interpolation.
    hats = np.array([np.interp(fine, wavelength, row) for row in np.eye(len(wavelength))])
    return np.asarray(seen @ hats.T)


def chromatic_rgb(xyz: Array) -> npt.NDArray[np.uint8]:
    """SRGB (..., 3), 8 bits, with the chromaticity of XYZ (..., 3) and the largest channel full.

    Brightness is left out: a lobe's peak and its foot differ by decades, and shading shows the shape.
    Colours outside sRGB are brought in by adding white.
    """
    rgb = np.asarray(xyz, dtype=np.float64) @ XYZ_TO_RGB.T
    rgb = rgb - np.minimum(rgb.min(axis=-1, keepdims=True), 0.0)
    largest = rgb.max(axis=-1, keepdims=True)
    rgb = np.divide(rgb, largest, out=np.ones_like(rgb), where=largest > 0.0)
    encoded = np.where(rgb <= 0.0031308, 12.92 * rgb, 1.055 * rgb ** (1.0 / 2.4) - 0.055)
    return np.asarray(np.rint(255.0 * encoded), dtype=np.uint8)
