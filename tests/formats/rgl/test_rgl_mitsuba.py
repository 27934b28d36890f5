"""Files read as Mitsuba's own `measured` plugin reads them, and files that it renders within tolerance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clbrdf import Scan
from clbrdf.formats.registry import find_format
from clbrdf.formats.rgl.accuracy import check_directions, random_incidents
from clbrdf.formats.rgl.export import export_material
from clbrdf.formats.rgl.nodes import stored_nodes
from clbrdf.formats.rgl.tables import Tables, read_tables, write_tables
from clbrdf.formats.rgl.values import TensorReader
from tests.formats.rgl.materials import MATERIALS, WAVELENGTH, coloured, mitsuba_brdf, spectral

FIELDS = ("description", "phi_i", "theta_i", "ndf", "sigma", "vndf", "luminance", "spectra", "wavelength")

# Mitsuba works in single precision: shares of a density are good to 1e-6, and a sample next to a steep
# place of the table takes that up some hundred times.
SINGLE = 1e-4


@pytest.fixture(params=["cc_ibiza_sunset_rgb", "paper_white_rgb"])
def database_file(request, coatings):
    path = coatings.parent / "formats" / "rgl" / f"{request.param}.bsdf"
    if not path.is_file():
        pytest.skip("the samples of the RGL database (../shared/data) are not on this machine")
    return path


def random_directions(count, seed=0):
    rng = np.random.default_rng(seed)
    return rng.uniform(0, 80, count), rng.uniform(0, 85, count), rng.uniform(0, 360, count)


def test_database_files_between_nodes(database_file):
    angles = random_directions(400)
    mine, theirs = (
        TensorReader(read_tables(database_file)).brdf(*angles),
        mitsuba_brdf(database_file, *angles),
    )
    assert np.abs(mine - theirs).sum() / np.abs(theirs).sum() < 1e-5
    np.testing.assert_allclose(mine, theirs, rtol=1e-3, atol=1e-6)


def test_database_files_at_nodes(database_file):
    nodes = stored_nodes(read_tables(database_file))
    mirror = np.hypot(nodes.theta_r - nodes.theta_i, (nodes.phi_r + 180.0) % 360.0) < 0.05
    chosen = np.random.default_rng(1).choice(np.flatnonzero(~mirror & (nodes.theta_r < 87.0)), 800, False)
    angles = nodes.theta_i[chosen], nodes.theta_r[chosen], nodes.phi_r[chosen] - nodes.phi_i[chosen]
    theirs = mitsuba_brdf(database_file, *angles)
    away = np.abs(nodes.brdf[chosen] - theirs).max(axis=1) / np.abs(theirs).max(axis=1)
    # Values of 1e-6 beside a lobe of 1 are digits of single precision, hence not of all nodes.
    assert np.quantile(away, 0.99) < SINGLE
    assert np.median(away) < 1e-6


def test_database_files_become_scans(database_file):
    (reading,) = find_format(database_file).read(database_file)
    scan = Scan(
        reading.theta_i,
        reading.phi_i,
        reading.theta_r,
        reading.phi_r,
        np.full(3, np.nan),
        reading.values,
        bands=reading.bands,
    )
    assert scan.bands == ("R", "G", "B")
    assert 5000 < len(scan) < 8 * 32 * 32
    assert scan.repeated_directions() == 0
    assert len(scan.incident_angles) == 7


def anisotropic(folds, seed=3):
    """Tables of random content whose incident azimuths cover a part of the turn, as the database has them."""
    rng = np.random.default_rng(seed)
    start, stop, count = {1: (-np.pi, np.pi, 9), 2: (-np.pi, 0.0, 5), 4: (-np.pi, -np.pi / 2, 4)}[folds]
    incident = (count, 4)
    return Tables(
        description="made",
        phi_i=np.linspace(start, stop, count),
        theta_i=np.deg2rad([0.0, 25.0, 55.0, 89.0]),
        ndf=1.0 + rng.random((6, 9)),
        sigma=0.5 + rng.random((5, 8)),
        vndf=0.2 + rng.random((*incident, 7, 6)),
        luminance=np.ones((*incident, 11, 11)),
        spectra=0.2 + rng.random((*incident, 3, 11, 11)),
    )


@pytest.mark.parametrize("folds", [1, 2, 4])
def test_anisotropic_files(tmp_path, folds):
    path = tmp_path / "a.bsdf"
    write_tables(path, anisotropic(folds))
    tables = read_tables(path)
    assert tables.folds == folds
    phi_i = np.random.default_rng(5).uniform(0.0, 360.0, 300)
    angles = random_directions(300, seed=4)
    mine, theirs = TensorReader(tables).brdf(*angles, phi_i), mitsuba_brdf(path, *angles, phi_i)
    np.testing.assert_allclose(mine, theirs, rtol=SINGLE)


@pytest.mark.parametrize("folds", [2, 4])
def test_anisotropic_nodes(tmp_path, folds):
    tables = anisotropic(folds)
    path = tmp_path / "a.bsdf"
    write_tables(path, tables)
    nodes = stored_nodes(tables)
    turn = np.rad2deg(tables.phi_i.astype(float))
    # At the ends of the part that was measured, and where an azimuth of half vectors is ±180°, the tables of
    # a real material agree with what they are folded or turned to; these, of random numbers, do not.
    inner = (nodes.theta_i > 1.0) & (nodes.theta_r < 85.0) & (nodes.theta_r > 1.0)
    inner &= (nodes.phi_i > turn[0] + 1.0) & (nodes.phi_i < turn[-1] - 1.0)
    angles = (a[inner] for a in (nodes.theta_i, nodes.theta_r, nodes.phi_r - nodes.phi_i, nodes.phi_i))
    mine, theirs = nodes.brdf[inner], mitsuba_brdf(path, *angles)
    assert inner.sum() > 100
    assert np.quantile(np.abs(mine / theirs - 1.0), 0.95) < SINGLE


def test_spectral_files_with_and_without_jacobian(tmp_path):
    tables = replace(anisotropic(4), wavelength=WAVELENGTH)
    for jacobian in (True, False):
        path = tmp_path / f"{jacobian}.bsdf"
        write_tables(path, replace(tables, jacobian=jacobian))
        angles = random_directions(100, seed=6)
        theirs = mitsuba_brdf(path, *angles, 200.0, wavelength=WAVELENGTH)
        np.testing.assert_allclose(TensorReader(read_tables(path)).brdf(*angles, 200.0), theirs, rtol=SINGLE)


@pytest.mark.parametrize(
    ("name", "make"), [*((name, spectral) for name in MATERIALS), ("tin foil", coloured)]
)
def test_mitsuba_renders_within_the_tolerance(tmp_path, name, make):
    material = make(MATERIALS[name])
    made = export_material(material, 0.005)
    path = tmp_path / "m.bsdf"
    write_tables(path, made.tables)
    angles = check_directions(random_incidents(40, seed=9), 100, seed=7)
    theirs = mitsuba_brdf(path, *angles, wavelength=material.wavelength)
    truth = material.brdf(*angles, material.every_band)
    error = np.abs(theirs - truth).sum(axis=0) / np.abs(truth).sum(axis=0)
    # 4,000 directions, not those of the search, tell a sum to some 5 % of itself.
    assert error.max() < 0.005 * 1.05
    assert made.accuracy.reached <= 0.005
    mine = TensorReader(read_tables(path)).brdf(*angles)
    assert np.abs(mine - theirs).sum() / np.abs(theirs).sum() < 1e-5


def test_what_mitsuba_samples_is_what_it_evaluates(tmp_path):
    """The directional albedo by Mitsuba's own sampling is that of the model: the steering tables fit."""
    mi = pytest.importorskip("mitsuba", reason="needs mitsuba: pip install 'clbrdf[render]'")
    material = coloured(MATERIALS["ggx 0.1 + lambert"], (1.0, 1.0, 1.0))
    path = tmp_path / "m.bsdf"
    write_tables(path, export_material(material, 0.005).tables)
    mi.set_variant("scalar_rgb")
    plugin = mi.load_dict({"type": "measured", "filename": str(path)})
    rng = np.random.default_rng(8)
    for theta_i in (10.0, 60.0):
        at = mi.SurfaceInteraction3f()
        at.wi = [np.sin(np.deg2rad(theta_i)), 0.0, np.cos(np.deg2rad(theta_i))]
        weights = np.array(
            [plugin.sample(mi.BSDFContext(), at, 0.5, rng.random(2), True)[1][0] for _ in range(3000)]
        )
        u, v = rng.random((2, 200_000))
        # A third of the directions about the mirror direction would do better; so many do as well.
        theta_r, phi = np.rad2deg(np.arcsin(np.sqrt(u))), 360.0 * v
        truth = np.pi * MATERIALS["ggx 0.1 + lambert"](theta_i, theta_r, phi)
        sigma = np.hypot(weights.std() / np.sqrt(3000), truth.std() / np.sqrt(200_000))
        assert abs(weights.mean() - truth.mean()) < 4.0 * sigma + 0.005 * truth.mean()
        # Steering that does not fit makes rare weights heavy.
        assert weights.std() < 0.5 * weights.mean()
