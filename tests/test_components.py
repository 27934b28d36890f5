"""Components of a scan: kept by every selection, by files and by merging; refused where wrong."""

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clbrdf.cli import main
from clbrdf.errors import InputError
from clbrdf.scan import Component, Correlation, Scan

RANDOM, SYSTEMATIC = Correlation("random"), Correlation("systematic")


def covariance(scan, one):
    """(N W, N W) of one component, from the definition, entry by entry."""
    n, w = scan.brdf.shape
    u = (np.asarray(one.values) * (np.abs(scan.brdf) if one.relative else 1.0)).ravel()
    unit = np.stack(
        [
            np.sin(np.deg2rad(scan.theta_r)) * np.cos(np.deg2rad(scan.phi_r)),
            np.sin(np.deg2rad(scan.theta_r)) * np.sin(np.deg2rad(scan.phi_r)),
            np.cos(np.deg2rad(scan.theta_r)),
        ],
        axis=1,
    ) * (180.0 / np.pi)

    def r(correlation, i, j, place):
        if correlation.form == "random":
            same = place is not None and place[i] == place[j] if place is scan.theta_i else i == j
            return float(same)
        if correlation.form == "systematic":
            return 1.0
        if correlation.form == "groups":
            return float(correlation.groups[i] == correlation.groups[j])
        if correlation.form == "matrix":
            return correlation.matrix[i, j]
        return np.exp(-np.sum((place[i] - place[j]) ** 2) / (2.0 * correlation.width**2))

    out = np.empty((n * w, n * w))
    for i in range(n):
        for k in range(n):
            d = r(one.direction, i, k, unit) * r(one.incident_angle, i, k, scan.theta_i)
            for j in range(w):
                for m in range(w):
                    out[i * w + j, k * w + m] = d * r(one.wavelength, j, m, scan.wavelength)
    return out * np.outer(u, u)


def correlations(n, seed):
    """Correlations of every form for n places."""
    rng = np.random.default_rng(seed)
    a = rng.normal(size=(n, n + 1))
    cov = a @ a.T
    deviation = np.sqrt(np.diag(cov))
    corr = cov / np.outer(deviation, deviation)
    np.fill_diagonal(corr, 1.0)
    return [
        RANDOM,
        SYSTEMATIC,
        Correlation("bell", width=float(rng.uniform(5.0, 50.0))),
        Correlation("groups", groups=rng.integers(0, 3, n)),
        Correlation("matrix", matrix=(corr + corr.T) / 2.0),
    ]


def make_scan(n=6, w=3, seed=0, **more):
    rng = np.random.default_rng(seed)
    options = {"wavelength": 500.0 + 20.0 * np.arange(w), **more}
    return Scan(
        rng.choice([10.0, 30.0, 50.0], n),
        np.zeros(n),
        rng.uniform(0.0, 80.0, n),
        rng.uniform(0.0, 359.0, n),
        options.pop("wavelength"),
        rng.uniform(0.1, 2.0, (n, w)),
        **options,
    )


def make_components(n, w, seed):
    rng = np.random.default_rng(seed)
    over_directions, over_wavelengths = correlations(n, seed), correlations(w, seed + 1)
    angles = [SYSTEMATIC, RANDOM, Correlation("bell", width=15.0)]
    return tuple(
        Component(
            f"effect {k}",
            rng.uniform(-0.1, 0.1, (n, w)) if k % 2 else 0.02,
            bool(rng.integers(2)),
            over_directions[rng.integers(5)],
            angles[rng.integers(3)],
            over_wavelengths[rng.integers(5)],
        )
        for k in range(4)
    )


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 7), st.integers(1, 4), st.integers(0, 10_000))
def test_modes_and_coefficients_are_the_definition(n, w, seed):
    scan = make_scan(n, w, seed, components=make_components(n, w, seed))
    angles = {name: getattr(scan, name) for name in ("theta_i", "theta_r", "phi_r")}
    for one in scan.components:
        whole = covariance(scan, one)
        directions = one.direction_coefficients(angles)
        if not one.is_random:
            modes = one.direction_modes(angles)
            # Modes below 1e-10 of the largest are left out.
            assert modes @ modes.T == pytest.approx(directions, abs=1e-8)
        u = one.absolute(scan.brdf)
        wavelengths = one.wavelength.coefficients(scan.wavelength)
        formed = np.einsum("nw,nm,wv,mv->nwmv", u, directions, wavelengths, u).reshape(whole.shape)
        assert formed == pytest.approx(whole, abs=1e-12)


@settings(max_examples=25, deadline=None)
@given(st.integers(2, 7), st.integers(2, 4), st.integers(0, 10_000))
def test_a_selection_has_the_covariance_of_what_it_keeps(n, w, seed):
    scan = make_scan(n, w, seed, components=make_components(n, w, seed))
    rng = np.random.default_rng(seed)
    rows, columns = rng.permutation(n)[: n - 1], np.sort(rng.permutation(w)[: w - 1])
    part = scan.rows(rows).columns(columns)
    flat = (rows[:, None] * w + columns[None, :]).ravel()
    for one, kept in zip(scan.components, part.components, strict=True):
        expected = covariance(scan, one)[np.ix_(flat, flat)]
        assert covariance(part, kept) == pytest.approx(expected, abs=1e-14)


@settings(max_examples=15, deadline=None)
@given(st.integers(1, 6), st.integers(1, 4), st.integers(0, 10_000), st.booleans())
def test_a_file_keeps_them(tmp_path_factory, n, w, seed, bands):
    names = {"bands": tuple("RGBYKX"[:w]), "wavelength": np.full(w, np.nan)} if bands else {}
    components = make_components(n, w, seed)
    if bands:
        components = tuple(one for one in components if one.wavelength.form != "bell")
    scan = make_scan(n, w, seed, components=components, **names)
    path = tmp_path_factory.mktemp("components") / "scan.h5"
    scan.save(path)
    again = Scan.open(path)
    assert len(again.components) == len(scan.components)
    for one, other in zip(scan.components, again.components, strict=True):
        assert (one.name, one.relative) == (other.name, other.relative)
        # A percentage is stored: × 100 and × 0.01 may each round.
        np.testing.assert_allclose(other.values, one.values, rtol=3e-16)
        for dimension in ("direction", "incident_angle", "wavelength"):
            assert getattr(one, dimension).same(getattr(other, dimension)), dimension
    np.testing.assert_allclose(again.sigma, scan.sigma, rtol=1e-15)


def test_merged_scans_share_what_has_the_same_name():
    panel = Component("panel", 0.02)
    dark = Component("dark", 0.001, False, Correlation("groups", groups=[0, 0, 1]), wavelength=RANDOM)
    one = make_scan(3, 2, 1, components=(panel, dark))
    two = make_scan(3, 2, 2, components=(panel, dark, Component("lamp", 0.01)))
    both = Scan.merge([one, two])
    assert [c.name for c in both.components] == ["panel", "dark", "lamp"]
    joined = both.components[1].direction.groups
    assert (joined[:, None] == joined[None, :]).tolist() == np.kron(
        np.eye(2), [[1, 1, 0], [1, 1, 0], [0, 0, 1]]
    ).astype(bool).tolist()
    lamp = np.asarray(both.components[2].values)
    assert (lamp[:3] == 0.0).all()
    assert (lamp[3:] == 0.01).all()
    # Over wavelengths, and values that nobody measured.
    far = make_scan(3, 2, 1, wavelength=[700.0, 720.0], components=(panel, dark))
    wide = Scan.merge([one, far])
    assert wide.brdf.shape == (3, 4)
    assert (np.asarray(wide.components[0].values) == 0.02).all()


def test_the_random_part_and_the_total():
    scan = make_scan(
        4,
        2,
        components=(Component("noise", 0.01, True, RANDOM, SYSTEMATIC, RANDOM), Component("scale", 0.02)),
    )
    assert scan.random_sigma == pytest.approx(0.01 * scan.brdf, rel=1e-14)
    assert scan.sigma == pytest.approx(np.sqrt(5e-4) * scan.brdf, rel=1e-14)
    assert make_scan(4, 2, components=(Component("scale", 0.02),)).random_sigma is None


BAD = np.array([[1.0, 0.9, -0.9], [0.9, 1.0, 0.9], [-0.9, 0.9, 1.0]])


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Correlation("matrix", matrix=BAD), "indefinite"),
        (lambda: Correlation("matrix", matrix=[[1.0, 1.2], [1.2, 1.0]]), r"1.2 at \[0, 1\].*−1 to 1"),
        (lambda: Correlation("matrix", matrix=[[1.0, 0.2], [0.3, 1.0]]), "not symmetric"),
        (lambda: Correlation("matrix", matrix=[[0.9, 0.2], [0.2, 1.0]]), "itself by 1"),
        (lambda: Correlation("matrix", matrix=[[1.0, np.nan], [np.nan, 1.0]]), "give a number"),
        (lambda: Correlation("bell", width=-1.0), "positive"),
        (lambda: Correlation("sinc"), "unknown"),
        (lambda: make_scan(components=(Component("lamp", np.ones((2, 3))),)), "'lamp' has values of shape"),
        (lambda: make_scan(components=(Component("lamp", np.inf),)), "'lamp' has the uncertainty inf"),
        (lambda: make_scan(components=(Component("a", 0.1), Component("a", 0.1))), "two components"),
        (
            lambda: make_scan(
                components=(Component("lamp", 0.1, True, Correlation("matrix", matrix=np.eye(2))),)
            ),
            "for 2 places, and the scan has 6 directions",
        ),
    ],
)
def test_what_is_no_component_is_refused(make, words):
    with pytest.raises(InputError, match=words):
        make()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda m: m.__setitem__((0, 1), 0.3), "not symmetric"),
        (lambda m: (m.__setitem__((0, 1), 1.5), m.__setitem__((1, 0), 1.5)), "coefficients lie in"),
        (lambda m: m.__setitem__(slice(None), BAD), "indefinite"),
    ],
)
def test_a_damaged_matrix_is_told_with_file_and_component(tmp_path, change, words):
    path = tmp_path / "scan.h5"
    matrix = Component("panel", 0.01, wavelength=Correlation("matrix", matrix=np.eye(3)))
    make_scan(components=(matrix,)).save(path)
    with h5py.File(path, "r+") as file:
        stored = file["entry/data/u_panel_wavelength_matrix"]
        values = stored[()].astype(float)
        change(values)
        del file["entry/data/u_panel_wavelength_matrix"]
        file["entry/data/u_panel_wavelength_matrix"] = values
    with pytest.raises(InputError, match=f"scan.h5: component 'panel'.*{words}"):
        Scan.open(path)


def test_a_component_of_another_shape_is_told_with_its_file(tmp_path):
    path = tmp_path / "scan.h5"
    make_scan(components=(Component("panel", np.full((6, 3), 0.01)),)).save(path)
    with h5py.File(path, "r+") as file:
        attributes = dict(file["entry/data/u_panel"].attrs)
        del file["entry/data/u_panel"]
        file["entry/data/u_panel"] = np.ones((6, 2))
        file["entry/data/u_panel"].attrs["units"] = attributes["units"]
    with pytest.raises(InputError, match=r"scan.h5: component 'u_panel' has shape \(6, 2\)"):
        Scan.open(path)


def test_files_of_before_are_read_as_two_components(tmp_path):
    path = tmp_path / "scan.h5"
    scan = make_scan()
    scan.save(path)
    with h5py.File(path, "r+") as file:
        group = file["entry"].create_group("uncertainty")
        for name, share in (("point", 0.01), ("scale", 0.06)):
            group[f"brdf_errors_{name}"] = share * scan.brdf
            group[f"brdf_errors_{name}"].attrs["units"] = "1/sr"
    point, scale = Scan.open(path).components
    assert point.is_noise
    assert np.asarray(point.values) == pytest.approx(0.01 * scan.brdf)
    assert scale.relative
    assert np.asarray(scale.values) == pytest.approx(0.06)
    assert scale.words() == "one error for all values"


def test_the_command_line_tells_it_in_one_line(tmp_path, capsys):
    path = tmp_path / "scan.h5"
    make_scan(
        components=(Component("panel", 0.01, wavelength=Correlation("matrix", matrix=np.eye(3))),)
    ).save(path)
    with h5py.File(path, "r+") as file:
        file["entry/data/u_panel_wavelength_matrix"][...] = BAD
    for words in (["info", str(path)], ["fit", str(path), "-o", str(tmp_path / "fit.h5")]):
        assert main(words) == 2
        told = capsys.readouterr().err.strip()
        assert told.count("\n") == 0
        assert (
            "scan.h5: component 'panel' (/entry/data/u_panel): the correlation matrix is indefinite" in told
        )
    assert not (tmp_path / "fit.h5").exists()
