"""Scan to file to scan, each format within its own resolution, anisotropic and two-sided scans included."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from clbrdf import InputError, Scan
from clbrdf.formats.load import load_one
from clbrdf.formats.merl import node_directions
from clbrdf.formats.registry import format_for_writing, formats, get_format
from clbrdf.formats.vectors import from_specular
from clbrdf.geometry import ANGLES

SHARED = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=15)

waves = st.lists(st.integers(200, 2500), min_size=1, max_size=4, unique=True).map(sorted)
zeniths = st.lists(st.integers(1, 890), min_size=1, max_size=4, unique=True).map(
    lambda v: [a / 10 for a in sorted(v)]
)
azimuths = st.lists(st.integers(0, 3590), min_size=1, max_size=4, unique=True).map(
    lambda v: [a / 10 for a in sorted(v)]
)


@st.composite
def gridded(draw, sides=("reflection", "transmission"), flags=False):
    """A scan on a grid of θi, φi, θr, φr, anisotropic where there are several φi."""
    theta_i, phi_i, theta_r, phi_r = draw(zeniths), draw(azimuths), draw(zeniths), draw(azimuths)
    if draw(st.sampled_from(sides)) == "transmission":
        theta_r = [180.0 - a for a in theta_r]
    grid = [a.ravel() for a in np.meshgrid(theta_i, phi_i, theta_r, phi_r, indexing="ij")]
    pole = np.isin(grid[2], (0.0, 180.0)) & (grid[3] != phi_r[0])
    grid = [a[~pole] for a in grid]
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    nm = draw(waves)
    values = np.exp(rng.normal(0.0, 3.0, (len(grid[0]), len(nm))))
    more = {}
    if flags:
        more["sigma"] = np.where(rng.random(values.shape) < 0.2, np.nan, 0.1 * values)
        values = np.where(rng.random(values.shape) < 0.1, -0.01 * values, values)
        masked = rng.random(values.shape) < 0.1
        more["flags"] = np.where(masked, np.uint32(1 << 5), np.uint32(0))
        more["flag_names"] = ("not_measured", "not_a_number", "infinite", "zero", "negative", "shaded")
        more["solid_angle"] = 1e-3
        more["bandpass"] = 2.5
    return Scan(*grid, nm, values, sample=draw(st.sampled_from(["", "foil", 'a, "b" µ'])), **more)


def vectors(scan: Scan) -> np.ndarray:
    """Source and view as unit vectors: at a pole the azimuth says nothing."""
    out = []
    for zenith, azimuth in ((scan.theta_i, scan.phi_i), (scan.theta_r, scan.phi_r)):
        z, a = np.deg2rad(zenith), np.deg2rad(azimuth)
        out += [np.sin(z) * np.cos(a), np.sin(z) * np.sin(a), np.cos(z)]
    return np.stack(out, axis=1)


def partners(ours: Scan, theirs: Scan, degrees: float) -> np.ndarray:
    """The row of theirs that is each of ours, one to one."""
    assert ours.brdf.shape == theirs.brdf.shape
    distance, place = cKDTree(vectors(theirs)).query(vectors(ours))
    assert distance.max() <= np.deg2rad(degrees) + 1e-12
    assert len(np.unique(place)) == len(place)
    return place


def compare(ours: Scan, theirs: Scan, values: float, degrees: float) -> None:
    theirs = theirs.rows(partners(ours, theirs, degrees))
    assert ours.bands == theirs.bands
    np.testing.assert_allclose(theirs.wavelength, ours.wavelength, rtol=1e-15)
    np.testing.assert_allclose(theirs.brdf, ours.brdf, rtol=values)


def through(scan: Scan, name: str, folder) -> Scan:
    path = folder / f"file.{name}"
    get_format(name).write(scan, path)
    return load_one([path])


@pytest.mark.parametrize(
    ("name", "values", "degrees"), [("wide", 0.0, 0.0), ("astm", 0.0, 1e-9), ("bird", 0.0, 0.0)]
)
@SHARED
@given(scan=gridded())
def test_tables(tmp_path, name, values, degrees, scan):
    compare(scan, through(scan, name, tmp_path), values, degrees)


@SHARED
@given(scan=gridded(flags=True))
def test_columns_keep_everything(tmp_path, scan):
    back = through(scan, "columns", tmp_path)
    for name in (*ANGLES, "wavelength", "brdf", "sigma", "bandpass", "solid_angle"):
        np.testing.assert_array_equal(getattr(back, name), getattr(scan, name))
    np.testing.assert_array_equal(back.mask, scan.mask)
    assert back.flag_counts() == scan.flag_counts()
    assert back.sample == scan.sample


@SHARED
@given(scan=gridded(flags=True))
def test_bird_keeps_uncertainties_and_leaves_masked_values_out(tmp_path, scan):
    if scan.mask.all():
        with pytest.raises(InputError, match="every value is masked"):
            through(scan, "bird", tmp_path)
        return
    back = through(replace(scan, source_polarisation="s", detector_polarisation="p"), "bird", tmp_path)
    assert (back.source_polarisation, back.detector_polarisation) == ("s", "p")
    assert (~back.mask).sum() == (~scan.mask).sum()
    np.testing.assert_array_equal(np.sort(back.brdf[~back.mask]), np.sort(scan.brdf[~scan.mask]))


@SHARED
@given(scan=gridded())
def test_ssdd_on_a_spherical_grid(tmp_path, scan):
    compare(scan, through(scan, "ssdd", tmp_path), 1e-7, 1e-9)  # 32-bit floats


def about_specular(theta_i, azimuth, radial, rotations, seed, transmission=False, columns=1):
    grid = [a.ravel() for a in np.meshgrid(rotations, theta_i, azimuth, radial, indexing="ij")]
    theta_r, phi = from_specular(grid[1], grid[2], grid[3])
    keep = (theta_r < 90.0 - 1e-6) & ~((grid[3] == 0.0) & (grid[2] != azimuth[0]))
    values = np.exp(np.random.default_rng(seed).normal(0.0, 2.0, (keep.sum(), columns)))
    theta_r = 180.0 - theta_r if transmission else theta_r
    return grid[1][keep], grid[0][keep], theta_r[keep], (grid[0] + phi)[keep], values


incidences = st.lists(st.integers(2, 85), min_size=1, max_size=3, unique=True).map(sorted)
# Half degrees keep the radial angles, whole ones, from meeting the normal.
radials = st.lists(st.integers(1, 120), min_size=1, max_size=5, unique=True).map(
    lambda v: [0.0, *map(float, sorted(v))]
)
turns = st.sampled_from([[0.0, 60.0, 120.0, 180.0], [0.0, 90.0, 180.0, 270.0], [0.0, 180.0]])
rotations = st.sampled_from([[0.0], [0.0, 30.0, 90.0]])


@SHARED
@given(incidences, turns, radials, rotations, st.integers(0, 1000), st.booleans())
def test_zemax_and_ssdd_about_the_specular_direction(
    tmp_path, theta_i, azimuth, radial, turned, seed, transmission
):
    grid = about_specular(np.array(theta_i) + 0.5, azimuth, radial, turned, seed, transmission)
    scan = Scan(*grid[:4], [633.0], grid[4])
    compare(scan, through(scan, "zemax", tmp_path), 0.0, 1e-6)
    compare(scan, through(scan, "ssdd", tmp_path), 1e-7, 1e-6)
    xyz = replace(
        scan, wavelength=[np.nan] * 3, bands=("X", "Y", "Z"), brdf=np.repeat(scan.brdf, 3, axis=1), flags=None
    )
    compare(xyz, through(xyz, "zemax", tmp_path), 0.0, 1e-6)


def test_merl_at_its_own_directions(tmp_path):
    nodes = node_directions()
    rng = np.random.default_rng(1)
    part = np.sort(rng.choice(len(nodes), 20_000, replace=False))
    d = nodes[part]
    values = np.exp(rng.normal(0.0, 2.0, (len(part), 3)))
    scan = Scan(d.theta_i, d.phi_i, d.theta_r, d.phi_r, [np.nan] * 3, values, bands=("R", "G", "B"))
    back = through(scan, "merl", tmp_path)
    measured = back.rows(~back.mask.any(axis=1))
    # Near the normal and the mirror direction several cells are one direction; there a file holds their mean.
    single = np.unique(
        np.round(np.stack([scan.theta_i, scan.theta_r, scan.phi]), 6), axis=1, return_counts=True
    )
    assert measured.brdf.size > 0.8 * values.size
    tree = cKDTree(np.stack([measured.theta_i, measured.theta_r, measured.phi], axis=1))
    distance, place = tree.query(np.stack([scan.theta_i, scan.theta_r, scan.phi], axis=1))
    same = distance < 1e-6
    assert same.mean() > 0.95
    close = np.isclose(measured.brdf[place[same]], values[same], rtol=1e-12).all(axis=1)
    assert close.mean() > 0.95
    assert len(single[1]) > 0


ANISOTROPIC = Scan(
    [30.0] * 2, [0.0, 45.0], [20.0] * 2, [180.0, 225.0], [np.nan] * 3, np.ones((2, 3)), bands=("R", "G", "B")
)
SCATTERED = Scan(
    np.arange(10.0, 40.0),
    np.arange(30.0),
    np.arange(5.0, 35.0),
    np.arange(30.0) * 7,
    [500.0],
    np.ones((30, 1)),
)


@pytest.mark.parametrize(
    ("name", "scan", "message"),
    [
        ("merl", ANISOTROPIC, "2 incident azimuths, and MERL files hold no anisotropy"),
        ("merl", SCATTERED, "MERL files hold R, G and B, and the scan has 1 wavelengths"),
        ("zemax", SCATTERED, "are scattered|not in the scan"),
        ("ssdd", SCATTERED, "30 directions are no grid"),
        ("zemax", ANISOTROPIC, "one wavelength, or X, Y and Z, and the scan has 3"),
        ("bird", ANISOTROPIC, "BiRD files hold wavelengths, and the scan has the bands R, G, B"),
        ("wide", ANISOTROPIC, "wide tables hold wavelengths"),
    ],
)  # fmt: skip
def test_what_a_format_cannot_hold_is_refused(tmp_path, name, scan, message):
    with pytest.raises(InputError, match=message):
        get_format(name).write(scan, tmp_path / "file")


def test_masked_values_do_not_become_a_grid(tmp_path):
    scan = Scan([10.0], 0.0, [20.0], 180.0, [500.0], [[np.nan]])
    for name in ("ssdd", "zemax"):
        with pytest.raises(InputError, match="1 values are masked"):
            get_format(name).write(scan, tmp_path / "file")


def test_the_format_follows_from_the_ending(tmp_path):
    expected = {".csv": "columns", ".wide.csv": "wide", ".ssdd": "ssdd", ".json": "bird", ".binary": "merl"}
    for ending, name in expected.items():
        assert format_for_writing(tmp_path / f"a{ending}").name == name
    with pytest.raises(InputError, match="no format writes files of this ending; name one with --format"):
        format_for_writing(tmp_path / "a.xyz")
    with pytest.raises(InputError, match="speos files are only read"):
        format_for_writing(tmp_path / "a.brdf", "speos")
    assert {name for name, each in formats().items() if each.write} >= {
        "columns", "wide", "bird", "astm", "ssdd", "zemax", "merl",
    }  # fmt: skip
