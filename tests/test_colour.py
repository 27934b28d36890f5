"""Colours against the CIE tables and known surfaces."""

from __future__ import annotations

import numpy as np
import pytest

from clbrdf import InputError
from clbrdf.colour import (
    ILLUMINANTS,
    cie,
    colour_weights,
    encode_srgb,
    get_illuminant,
    rgb_weights,
)
from clbrdf.viz.colour import chromatic_rgb

# CIE 1931 2° colour matching functions (CIE 018:2019, table 6; Wyszecki and Stiles, table I(3.3.1)).
CIE_1931 = np.array(
    [
        (400, 0.0143, 0.0004, 0.0679),
        (420, 0.1344, 0.0040, 0.6456),
        (440, 0.3483, 0.0230, 1.7471),
        (450, 0.3362, 0.0380, 1.7721),
        (460, 0.2908, 0.0600, 1.6692),
        (480, 0.0956, 0.1390, 0.8130),
        (500, 0.0049, 0.3230, 0.2720),
        (520, 0.0633, 0.7100, 0.0782),
        (540, 0.2904, 0.9540, 0.0203),
        (555, 0.5121, 1.0000, 0.0057),
        (560, 0.5945, 0.9950, 0.0039),
        (580, 0.9163, 0.8700, 0.0017),
        (600, 1.0622, 0.6310, 0.0008),
        (620, 0.8544, 0.3810, 0.0002),
        (640, 0.4479, 0.1750, 0.0000),
        (660, 0.1649, 0.0610, 0.0000),
        (680, 0.0468, 0.0170, 0.0000),
        (700, 0.0114, 0.0041, 0.0000),
    ]
)
GRID = np.arange(380.0, 781.0, 10.0)


def test_matching_functions_are_those_of_the_printed_table():
    places = ((CIE_1931[:, 0] - 380.0) / 5.0).astype(int)
    table = np.array([cie.X_BAR, cie.Y_BAR, cie.Z_BAR])[:, places].T
    # The printed table has four digits after the point.
    np.testing.assert_allclose(table, CIE_1931[:, 1:], atol=5.1e-5)
    # CIE 15:2004: the three functions have the same integral.
    sums = [cie.X_BAR.sum(), cie.Y_BAR.sum(), cie.Z_BAR.sum()]
    np.testing.assert_allclose(sums, 21.3714, atol=3e-4)


def test_matching_functions_are_near_the_fit_by_gaussians():
    """All 243 numbers, by another way: Wyman, Sloan and Shirley, JCGT 2(2), 2013, equation (4)."""
    nm = cie.WAVELENGTH

    def lobe(height, centre, below, above):
        return height * np.exp(-0.5 * ((nm - centre) * np.where(nm < centre, below, above)) ** 2)

    fits = (
        lobe(0.362, 442.0, 0.0624, 0.0374) + lobe(1.056, 599.8, 0.0264, 0.0323)
        + lobe(-0.065, 501.1, 0.0490, 0.0382),
        lobe(0.821, 568.8, 0.0213, 0.0247) + lobe(0.286, 530.9, 0.0613, 0.0322),
        lobe(1.217, 437.0, 0.0845, 0.0278) + lobe(0.681, 459.0, 0.0385, 0.0725),
    )  # fmt: skip
    for fit, table in zip(fits, (cie.X_BAR, cie.Y_BAR, cie.Z_BAR), strict=True):
        # The fit itself is good to about 1 % of the peak: it finds slips in the first two digits.
        assert np.sqrt(np.mean((fit - table) ** 2)) < 0.0065
        assert np.abs(fit - table).max() < 0.0225


# Chromaticities as CIE 15:2004 prints them, tables T.3 and T.8.
WHITES = {
    "D65": (0.31272, 0.32903),
    "D50": (0.34567, 0.35851),
    "A": (0.44758, 0.40745),
    "E": (0.33333, 0.33333),
    "FL2": (0.3721, 0.3751),
    "FL11": (0.3805, 0.3769),
}


@pytest.mark.parametrize("name", ILLUMINANTS)
def test_illuminants_have_the_chromaticity_of_the_cie(name):
    xyz = colour_weights(cie.WAVELENGTH, name).sum(axis=1)
    np.testing.assert_allclose(xyz[:2] / xyz.sum(), WHITES[name], atol=6e-5)
    np.testing.assert_allclose(get_illuminant(f" {name.lower()} "), ILLUMINANTS[name])


def test_unknown_illuminant():
    with pytest.raises(InputError, match="'D60' is not known; choose one of D65, D50, A, E, FL2, FL11"):
        rgb_weights(cie.WAVELENGTH, "D60")


@pytest.mark.parametrize("name", ILLUMINANTS)
def test_white_is_white_and_grey_is_grey_under_each(name):
    weights = rgb_weights(cie.WAVELENGTH, name)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-12)
    coarse = np.arange(400.0, 701.0, 20.0)
    np.testing.assert_allclose(rgb_weights(coarse, name) @ np.full(16, 0.3), 0.3, atol=1e-12)


def test_a_red_surface_is_redder_by_lamp_light():
    red = np.where(cie.WAVELENGTH > 600.0, 0.8, 0.1)
    by_day, by_lamp = (rgb_weights(cie.WAVELENGTH, name) @ red for name in ("D65", "A"))
    assert by_day[0] > 3 * by_day[1]
    assert by_lamp[0] > by_day[0]


def test_srgb_encoding():
    # IEC 61966-2-1: the straight part ends at 0.0031308; middle grey 0.2140 is 0.5.
    np.testing.assert_allclose(
        encode_srgb(np.array([0.0, 0.0031308, 0.21404, 1.0, 2.0, -1.0])),
        [0.0, 0.04045, 0.5, 1.0, 1.0, 0.0],
        atol=1e-5,
    )


def test_a_flat_spectrum_is_white():
    xyz = colour_weights(GRID) @ np.ones(len(GRID))
    # CIE 15:2004: D65 has x = 0.3127, y = 0.3290.
    np.testing.assert_allclose(xyz[:2] / xyz.sum(), [0.3127, 0.3290], atol=2e-4)
    assert xyz[1] == pytest.approx(1.0, abs=1e-12)
    assert chromatic_rgb(xyz).min() >= 252


def test_few_wavelengths_do_as_well_for_a_smooth_spectrum():
    coarse = np.array([420.0, 470.0, 520.0, 570.0, 620.0, 670.0])
    slope = np.interp(GRID, [380, 780], [0.2, 1.0])
    fine = colour_weights(GRID) @ slope
    few = colour_weights(coarse) @ np.interp(coarse, GRID, slope)
    np.testing.assert_allclose(few, fine, rtol=0.02)


@pytest.mark.parametrize(
    ("spectrum", "order"),
    [
        (np.where(GRID > 600, 1.0, 0.05), (0, 1, 2)),  # red
        (np.where((GRID > 500) & (GRID < 570), 1.0, 0.05), (1, 0, 2)),  # green
        (np.where(GRID < 490, 1.0, 0.05), (2, 1, 0)),  # blue
    ],
)
def test_surfaces_have_their_colour(spectrum, order):
    rgb = chromatic_rgb(colour_weights(GRID) @ spectrum).astype(int)
    assert rgb[order[0]] == 255
    assert rgb[order[0]] > rgb[list(order[1:])].max() + 40


def test_brightness_is_left_out_and_black_is_white():
    xyz = colour_weights(GRID) @ np.linspace(0.1, 0.9, len(GRID))
    np.testing.assert_array_equal(chromatic_rgb(xyz), chromatic_rgb(1e-6 * xyz))
    np.testing.assert_array_equal(chromatic_rgb(np.zeros(3)), [255, 255, 255])


@pytest.mark.parametrize(
    "waves", [[650.0], [450.0, 650.0], [450.0, 550.0, 700.0], [500.0, 550.0, 600.0, 650.0]]
)
def test_too_little_of_a_spectrum(waves):
    with pytest.raises(InputError, match="a colour needs a spectrum from 460 to 620 nm"):
        colour_weights(np.array(waves))
