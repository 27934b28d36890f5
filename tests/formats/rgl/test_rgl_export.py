"""Files written for BRDFs that are known: accuracy, growth, and what cannot be written."""

from __future__ import annotations

import numpy as np
import pytest

from clbrdf import InputError
from clbrdf.formats.rgl.accuracy import measure_accuracy, random_incidents
from clbrdf.formats.rgl.export import export_material
from clbrdf.formats.rgl.material import Material, projected
from clbrdf.formats.rgl.nodes import stored_nodes
from clbrdf.formats.rgl.tables import size_of
from clbrdf.formats.rgl.values import TensorReader
from tests.formats.rgl.database_layout import database_tables
from tests.formats.rgl.materials import MATERIALS, coloured, ggx, lambert, spectral, total


def independent_error(made, material, count=20_000, seed=11):
    """Σ|error|/Σ|f| over directions drawn here: uniform in the cosine, θi 3–80°, θr to 85°."""
    rng = np.random.default_rng(seed)
    theta_i, phi = rng.uniform(3, 80, count), rng.uniform(0, 360, count)
    theta_r = np.rad2deg(np.arccos(rng.uniform(np.cos(np.deg2rad(85)), 1.0, count)))
    truth = material.brdf(theta_i, theta_r, phi, material.every_band)
    value = TensorReader(made.tables).brdf(theta_i, theta_r, phi)
    return np.abs(value - truth).sum(axis=0) / np.abs(truth).sum(axis=0)


@pytest.mark.parametrize("tolerance", [0.03, 0.005])
@pytest.mark.parametrize("name", ["ggx 0.1 + lambert", "tin foil"])
def test_the_tolerance_is_kept(name, tolerance):
    material = spectral(MATERIALS[name])
    made = export_material(material, tolerance)
    assert made.accuracy.reached <= tolerance
    assert made.accuracy.light <= 3.0 * tolerance
    assert made.accuracy.worst_incident[1] < 3.0 * tolerance
    # Without the half of the directions near the mirror direction the sum has less of the lobe in it.
    assert independent_error(made, material).max() < 4.0 * tolerance


def test_a_smaller_tolerance_takes_a_larger_file():
    material = spectral(MATERIALS["tin foil"])
    sizes = [export_material(material, tolerance).tables.spectra.size for tolerance in (0.05, 0.02, 0.008)]
    assert sizes == sorted(sizes)
    assert sizes[0] < sizes[2] / 3


def test_nodes_hold_the_brdf():
    material = spectral(MATERIALS["ggx 0.1 + lambert"])
    nodes = stored_nodes(export_material(material, 0.02).tables)
    above = (nodes.theta_r < 89.0) & (nodes.theta_i < 89.0)
    angles = (a[above] for a in (nodes.theta_i, nodes.theta_r, nodes.phi_r - nodes.phi_i))
    truth = material.brdf(*angles, material.every_band)
    # Tables are in single precision: 2^-24 for each of three factors, and the place of a node next to a lobe.
    np.testing.assert_allclose(nodes.brdf[above], truth, rtol=2e-5)


@pytest.mark.parametrize("name", MATERIALS)
def test_nowhere_negative_and_not_brighter(name):
    material = coloured(MATERIALS[name], (1.0, 1.0, 1.0))
    tables = export_material(material, 0.01).tables
    assert tables.spectra.min() >= 0.0
    assert (tables.luminance > 0.0).all()
    rng = np.random.default_rng(2)
    phi, theta_r = rng.uniform(0, 360, 40_000), np.rad2deg(np.arcsin(np.sqrt(rng.uniform(0, 0.999, 40_000))))
    for theta_i in (5.0, 45.0, 75.0):
        value = np.pi * TensorReader(tables).brdf(theta_i, theta_r, phi)[:, 0].mean()
        truth = np.pi * MATERIALS[name](theta_i, theta_r, phi).mean()
        # Three times the tolerance, as documented; that holds up to 85°, and the foil has light beyond.
        assert value == pytest.approx(truth, rel=0.03)


def test_a_lambertian_surface_is_almost_exact():
    made = export_material(spectral(lambert(0.5)), 0.02)
    assert made.rounds == 1
    # ρ/π, over θr up to 85°: the kink at the horizon is all that is left, on a grid of 20 × 20.
    assert made.accuracy.reached < 0.015
    assert export_material(spectral(lambert(0.5)), 0.003).accuracy.reached <= 0.003


def test_a_lobe_of_a_tenth_of_a_degree():
    material = coloured(total(ggx(0.002, 1.0), lambert(0.1)))
    made = export_material(material, 0.01)
    assert made.accuracy.reached <= 0.01
    peak = TensorReader(made.tables).brdf(40.0, 40.0, 180.0)[0]
    np.testing.assert_allclose(
        peak, material.brdf(*(np.array([a]) for a in (40.0, 40.0, 180.0)), np.arange(3))[0], rtol=0.02
    )


def test_wavelengths_that_differ_are_each_within_the_tolerance():
    narrow, wide = ggx(0.05, 0.04), ggx(0.4, 0.9)
    wavelength = np.linspace(400.0, 700.0, 9)
    share = np.linspace(0.0, 1.0, 9)

    def brdf(theta_i, theta_r, phi, bands):
        angles = theta_i, theta_r, phi
        return narrow(*angles)[:, None] * (1.0 - share[bands]) + wide(*angles)[:, None] * share[bands]

    made = export_material(Material(brdf, wavelength), 0.01)
    assert made.accuracy.by_band.shape == (9,)
    assert made.accuracy.by_band.max() <= 0.01


def test_bands_of_rgb_may_be_negative():
    material = coloured(MATERIALS["ggx 0.1 + lambert"], (0.8, 0.3, -0.02))
    made = export_material(material, 0.01)
    assert made.accuracy.reached <= 0.01
    assert made.tables.spectra[:, :, 2].max() <= 0.0


def test_the_same_material_makes_the_same_file():
    first, second = (export_material(spectral(MATERIALS["ggx 0.03 + lambert"]), 0.01) for _ in range(2))
    np.testing.assert_array_equal(first.tables.spectra, second.tables.spectra)
    assert first.accuracy.reached == second.accuracy.reached


@pytest.mark.parametrize("tolerance", [0.0, -0.1, 0.00049, 0.6, np.nan])
def test_tolerances_that_make_no_sense(tolerance):
    with pytest.raises(InputError, match=r"tolerance is .*; it lies between 0.0005"):
        export_material(spectral(lambert(0.5)), tolerance)


def test_a_tolerance_that_would_take_too_large_a_file():
    with pytest.raises(InputError, match=r"a file within 0.1 % would take about .* MB; .* % was reached"):
        export_material(spectral(MATERIALS["tin foil"]), 0.001, most_bytes=2_000_000)


@pytest.mark.parametrize("name", MATERIALS)
def test_the_grid_of_the_database_is_coarser_by_ten_times(name):
    material = spectral(MATERIALS[name])
    database = database_tables(MATERIALS[name])
    coarse = measure_accuracy(material, TensorReader(database), np.arange(3), random_incidents(64, 5), 256, 5)
    made = export_material(material, 0.005)
    assert coarse.reached > 10.0 * made.accuracy.reached
    if name != "tin foil":
        assert size_of(made.tables) < 1.1 * size_of(database)


def test_nothing_to_export():
    with pytest.raises(InputError, match="nowhere positive"):
        export_material(spectral(lambert(0.0)))


def test_below_the_horizon_values_go_on_smoothly_and_keep_their_sign():
    material = spectral(MATERIALS["tin foil"])
    bands = material.every_band
    cosine = np.array([1e-3, -1e-3, -0.1, -0.9])
    values = projected(material, bands, np.deg2rad(50.0), cosine, np.full(4, 2.0))
    assert (values >= 0.0).all()
    # This lobe reaches the horizon with a value: no jump there.
    np.testing.assert_allclose(values[1], values[0], rtol=0.02)
    flat = projected(spectral(lambert(0.5)), bands, 0.3, cosine, np.zeros(4))
    np.testing.assert_allclose(flat[1:], 0.0, atol=6e-4)
