"""Scans to materials: interpolation between measured directions, and what cannot be interpolated."""

from __future__ import annotations

import numpy as np
import pytest

from clbrdf import InputError, Scan
from clbrdf.formats.rgl.format import FORMAT, scan_material, write
from clbrdf.formats.rgl.tables import read_tables
from clbrdf.formats.rgl.values import TensorReader
from tests.formats.rgl.materials import ggx, lambert, total

SURFACE = total(ggx(0.25, 0.04), lambert(0.3))
WAVES = np.array([450.0, 550.0, 650.0])


def scan_of(brdf, theta_i=(5.0, 25.0, 45.0, 65.0), zeniths=19, azimuths=19, **changes):
    theta_r, phi = np.linspace(0.0, 85.0, zeniths), np.linspace(0.0, 180.0, azimuths)
    i, r, p = (a.ravel() for a in np.meshgrid(theta_i, theta_r, phi, indexing="ij"))
    values = brdf(i, r, p)[:, None] * [0.8, 1.0, 1.2]
    return Scan(
        **(
            {
                "theta_i": i,
                "phi_i": np.zeros(1),
                "theta_r": r,
                "phi_r": p,
                "wavelength": WAVES,
                "brdf": values,
            }
            | changes
        )
    )


def test_measured_directions_keep_their_values():
    scan = scan_of(SURFACE)
    material, remarks = scan_material(scan)
    assert remarks == ()
    inside = scan.theta_r > 1.0  # at θr = 0 there are 19 azimuths of one direction
    angles = (a[inside] for a in (scan.theta_i, scan.theta_r, scan.phi))
    np.testing.assert_allclose(material.brdf(*angles, np.arange(3)), scan.brdf[inside], rtol=1e-6)


def test_between_measured_directions():
    material, _ = scan_material(scan_of(SURFACE))
    rng = np.random.default_rng(0)
    theta_i, theta_r, phi = rng.uniform(8, 62, 3000), rng.uniform(0, 75, 3000), rng.uniform(0, 360, 3000)
    value, truth = material.brdf(theta_i, theta_r, phi, np.array([1]))[:, 0], SURFACE(theta_i, theta_r, phi)
    # Steps of 5° by 10° by 20° in θi for a lobe 25° wide: some percent.
    assert np.abs(value - truth).sum() / truth.sum() < 0.04
    mirrored = material.brdf(theta_i, theta_r, 360.0 - phi, np.array([1]))[:, 0]
    np.testing.assert_allclose(mirrored, value, rtol=1e-6)


def test_beyond_measured_directions_the_nearest_holds():
    material, _ = scan_material(scan_of(lambert(0.3)))
    angles = np.array([1.0, 88.0]), np.array([89.0, 89.5]), np.array([10.0, 180.0])
    np.testing.assert_allclose(material.brdf(*angles, np.array([1])), 0.3 / np.pi, rtol=1e-12)


def test_a_scan_becomes_a_file_and_a_scan_again(tmp_path):
    scan = scan_of(SURFACE)
    path = tmp_path / "s.bsdf"
    write(scan, path)
    reader = TensorReader(read_tables(path))
    inside = (scan.theta_r > 1.0) & (scan.theta_r < 84.0)
    value = reader.brdf(scan.theta_i[inside], scan.theta_r[inside], scan.phi[inside])
    # The default tolerance holds for sums over the hemisphere; here are only the corners of the triangles.
    assert np.abs(value - scan.brdf[inside]).sum() / scan.brdf[inside].sum() < 0.02
    (reading,) = FORMAT.read(path)
    np.testing.assert_allclose(reading.spectrum, WAVES)
    truth = scan_material(scan)[0].brdf(
        reading.theta_i, np.minimum(reading.theta_r, 89.0), reading.phi_r, np.arange(3)
    )
    kept = reading.theta_r < 89.0
    np.testing.assert_allclose(reading.values[kept], truth[kept], rtol=1e-3)


def test_masked_values_repeats_and_azimuths_are_told():
    scan = scan_of(SURFACE)
    brdf = scan.brdf.copy()
    brdf[7, 1] = np.nan
    turned = np.where(np.arange(len(scan)) % 2 == 0, 0.0, 90.0)
    again = Scan(scan.theta_i, turned, scan.theta_r, scan.phi_r + turned, WAVES, brdf)
    material, remarks = scan_material(again)
    assert remarks[0] == "1 of 1444 directions with masked values are left out"
    assert "incident azimuths are averaged" in remarks[1]
    value = material.brdf(*(np.array([a]) for a in (25.0, 30.0, 100.0)), np.arange(3))
    np.testing.assert_allclose(value[0, 1], SURFACE(25.0, 30.0, 100.0), rtol=0.05)


def test_values_at_or_below_zero():
    scan = scan_of(lambert(0.3))
    brdf = scan.brdf.copy()
    brdf[200] = -0.001
    material, _ = scan_material(
        Scan(scan.theta_i, 0.0, scan.theta_r, scan.phi_r, WAVES, brdf, sigma=0.01 + 0.0 * brdf)
    )
    place = (np.array([angle[200]]) for angle in (scan.theta_i, scan.theta_r, scan.phi))
    value = material.brdf(*place, np.arange(3))
    assert (value > 0.0).all()
    assert (value < 1e-3).all()


@pytest.mark.parametrize(
    ("scan", "message"),
    [
        (scan_of(SURFACE, theta_i=(30.0,)), "has 1 incident zenith and cannot be interpolated"),
        (scan_of(SURFACE, theta_i=(30.0, 30.1)), "has 1 incident zenith and cannot be interpolated"),
        (scan_of(SURFACE, azimuths=2), "was measured in the plane of incidence only and cannot"),
        (
            scan_of(SURFACE, wavelength=np.full(3, np.nan), bands=("red", "green", "infrared")),
            "the bands red, green, infrared make no colour",
        ),
    ],
)
def test_what_cannot_be_interpolated(scan, message):
    with pytest.raises(InputError, match=message):
        scan_material(scan)


def test_some_incident_zeniths_in_plane_only():
    whole, plane = scan_of(SURFACE), scan_of(SURFACE, theta_i=(80.0,), azimuths=2)
    material, remarks = scan_material(Scan.merge([whole, plane]))
    assert remarks == ("1 of 5 incident zeniths, measured in their plane only, are left out",)
    assert material.bands == 3
