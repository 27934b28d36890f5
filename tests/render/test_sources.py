"""Fits and scans as materials in colour."""

from __future__ import annotations

import numpy as np
import pytest

from clbrdf import InputError, Scan, fit
from clbrdf.render.sources import (
    fit_source,
    in_colour,
    in_false_colour,
    material_at,
    open_source,
    scan_source,
)
from tests.formats.rgl.test_rgl_scans import SURFACE, scan_of

ANGLES = tuple(np.array([a, a]) for a in (30.0, 40.0, 120.0))


@pytest.fixture(scope="module")
def grey():
    """A surface that is the same at 16 wavelengths."""
    waves = np.arange(400.0, 701.0, 20.0)
    scan = scan_of(SURFACE, zeniths=9, azimuths=9)
    return Scan(
        scan.theta_i,
        0.0,
        scan.theta_r,
        scan.phi_r,
        waves,
        np.repeat(scan.brdf[:, 1:2], 16, axis=1),
        sample="grey",
    )


def test_a_fit_is_its_model(tmp_path, small_scan):
    result = fit(small_scan, seed=1)
    result.save(tmp_path / "fit.h5")
    source = open_source(tmp_path / "fit.h5")
    assert source.name == "foil"
    value = source.material.brdf(*ANGLES, np.array([0, 2]))
    direct = result.model.brdf(result.vector[:, None, :], result.model.features(small_scan.directions)).T
    at_scan = source.material.brdf(small_scan.theta_i, small_scan.theta_r, small_scan.phi, np.arange(3))
    np.testing.assert_allclose(at_scan, direct, rtol=1e-12)
    assert value.shape == (2, 2)


def test_wavelengths_without_a_fit_are_left_out(small_scan):
    brdf = small_scan.brdf.copy()
    brdf[:, 1] = np.nan
    angles = (getattr(small_scan, name) for name in ("theta_i", "phi_i", "theta_r", "phi_r"))
    source = fit_source(fit(Scan(*angles, small_scan.wavelength, brdf), seed=1))
    assert source.remarks == ("1 of 3 wavelengths have no fit and are left out",)
    np.testing.assert_array_equal(source.material.wavelength, [450.0, 650.0])


@pytest.mark.parametrize("illuminant", ["D65", "A", "fl11"])
def test_grey_is_grey(grey, illuminant):
    source = scan_source(grey)
    colour = in_colour(source, illuminant).material
    value = source.material.brdf(*ANGLES, np.array([3]))
    np.testing.assert_allclose(colour.brdf(*ANGLES, np.arange(3)), np.repeat(value, 3, axis=1), rtol=1e-9)
    assert colour.wavelength is None


def test_one_wavelength_is_shown_in_grey(grey):
    source = in_colour(material_at(scan_source(grey), np.array([652.0])))
    assert source.remarks == ("one wavelength: 660 nm in grey",)
    assert np.ptp(source.material.brdf(*ANGLES, np.arange(3)), axis=1).max() == 0.0


def test_false_colour_takes_three_wavelengths(small_scan):
    source = scan_source(scan_of(SURFACE))
    shown = in_false_colour(source, np.array([640.0, 550.0, 460.0]))
    value = source.material.brdf(*ANGLES, np.arange(3))
    np.testing.assert_array_equal(shown.material.brdf(*ANGLES, np.arange(3)), value[:, ::-1])
    assert shown.remarks == ("650, 550, 450 nm shown as red, green, blue",)


def test_what_has_no_colour():
    source = scan_source(scan_of(SURFACE, wavelength=[500.0, 600.0, 900.0]))
    with pytest.raises(
        InputError, match=r"a colour needs a spectrum from 460 .*take three of them with in_false_colour"
    ):
        in_colour(source)
    with pytest.raises(InputError, match="3 wavelengths, for red, green and blue; 2 are given"):
        in_false_colour(source, np.array([1.0, 2.0]))
    with pytest.raises(InputError, match="illuminant 'moon' is not known"):
        in_colour(scan_source(scan_of(SURFACE)), "moon")


def test_bands_are_their_own_colour():
    source = scan_source(scan_of(SURFACE, wavelength=np.full(3, np.nan), bands=("R", "G", "B")))
    assert in_colour(source).material is source.material
    for attempt in (
        lambda: in_colour(source, "A"),
        lambda: material_at(source, np.array([500.0])),
        lambda: in_false_colour(source, np.array([650.0, 550.0, 450.0])),
    ):
        with pytest.raises(InputError, match="the bands R, G, B"):
            attempt()


def test_messages_name_the_file(tmp_path):
    scan_of(SURFACE, azimuths=2).save(tmp_path / "plane.h5")
    with pytest.raises(
        InputError, match=r"plane.h5: the scan was measured in the plane of incidence only"
    ) as told:
        open_source(tmp_path / "plane.h5")
    assert str(told.value).count("plane.h5") == 1
    with pytest.raises(InputError, match=r"none\.h5"):
        open_source(tmp_path / "none.h5")
