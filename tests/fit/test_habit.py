"""What users of scientific Python expect of a record: short to print, easy to select and to carry on with."""

from __future__ import annotations

import csv
import pickle
from dataclasses import replace

import numpy as np
import pytest

import clbrdf
from clbrdf import DeviceError, Directions, InputError, Scan


@pytest.fixture(scope="module")
def scan():
    theta_i, theta_r = (a.ravel() for a in np.meshgrid([20.0, 40.0, 60.0], np.arange(0.0, 81.0, 10.0)))
    truth = (0.1 + 0.05 * np.cos(np.deg2rad(theta_r)) ** 4)[:, None] * np.array([1.0, 1.1, 1.2])
    noise = np.random.default_rng(5).standard_normal(truth.shape)
    return Scan(
        theta_i, 0.0, theta_r, 180.0, [500.0, 600.0, 700.0], truth * (1.0 + 0.02 * noise), 0.02 * truth,
        sample="paint & primer",
    )  # fmt: skip


@pytest.fixture(scope="module")
def fit(scan):
    return clbrdf.fit(scan, model="minnaert", weights="sigma")


def test_records_print_in_a_line(scan, fit):
    assert repr(scan) == "<Scan of paint & primer: 27 directions, 3 wavelengths (500 to 700 nm)>"
    assert repr(fit).startswith("<Fit of minnaert to paint & primer: 3 wavelengths, 3 converged")
    assert repr(scan.directions) == "<27 directions: θi 20 to 60°, θr 0 to 80°, φ 180°>"
    for record in (scan, fit):
        page = record._repr_html_()
        assert page.startswith("<table>")
        assert len(page) < 3000
    assert "paint &amp; primer" in scan._repr_html_()


@pytest.mark.parametrize("name", ["scan", "directions"])
def test_records_pickle_and_stay_read_only(scan, name):
    record = scan if name == "scan" else scan.directions
    again = pickle.loads(pickle.dumps(record))
    np.testing.assert_array_equal(again.theta_r, record.theta_r)
    with pytest.raises(ValueError, match="read-only"):
        again.theta_r[0] = 1.0


def test_a_scan_is_selected_by_places_masks_and_values(scan):
    np.testing.assert_array_equal(scan[scan.theta_i == 40.0, 1:].brdf, scan.brdf[scan.theta_i == 40.0, 1:])
    np.testing.assert_array_equal(scan[[3, 1]].theta_r, scan.theta_r[[3, 1]])
    assert scan[:, scan.wavelength > 550.0].wavelength.tolist() == [600.0, 700.0]
    few = scan.sel(theta_i=40.0, theta_r=slice(10, 40), wavelength=[590.0, 710.0])
    assert few.theta_r.tolist() == [10.0, 20.0, 30.0, 40.0]
    assert few.wavelength.tolist() == [600.0, 700.0]
    assert scan.sel(wavelength=slice(None, 600)).wavelength.tolist() == [500.0, 600.0]
    with pytest.raises(InputError, match="the scan has no theta_i 41; it has 20 to 60"):
        scan.sel(theta_i=41.0)
    with pytest.raises(InputError, match="the scan has 27 directions, and index 99"):
        scan[[99]]


def test_predictions_carry_the_covariance_of_the_parameters(fit):
    """Against draws of the parameters: 40,000 of them give a σ to 0.4 % (one standard error)."""
    directions = Directions.relative([20.0, 70.0], [30.0, 75.0], 180.0)
    values, sigma = fit.predict(directions, return_std=True)
    np.testing.assert_array_equal(values, fit.evaluate(directions))
    one = fit.estimate.sigma[1]
    covariance = fit.correlation[1] * np.outer(one, one)
    draws = np.random.default_rng(6).multivariate_normal(fit.vector[1], covariance, 40_000)
    seen = fit.model.brdf(draws[:, None, :], fit.model.features(directions))
    np.testing.assert_allclose(sigma[:, 1], seen.std(axis=0), rtol=0.02)
    # Without the correlations it would be another.
    jacobian = fit.model.jacobian(fit.vector[1][None], fit.model.features(directions))
    assert (np.abs(np.sqrt(((jacobian * one) ** 2).sum(axis=1)) / sigma[:, 1] - 1.0) > 0.05).any()


def test_wrong_types_are_told(fit):
    np.testing.assert_array_equal(fit.predict(fit.scan), fit.predict())
    with pytest.raises(InputError, match="directions are given as int; give a Scan, or Directions"):
        fit.predict(30)
    with pytest.raises(InputError, match="parameters are given as list; give a mapping"):
        clbrdf.fit(fit.scan, bounds=[1])
    with pytest.raises(InputError, match="fixed ks is 'a'; give a number"):
        clbrdf.fit(fit.scan, fix={"ks": "a"})
    with pytest.raises(InputError, match="fixed ks is -1; it has to be at least 0"):
        clbrdf.fit(fit.scan, fix={"ks": -1.0})
    with pytest.raises(InputError, match="parameter rho is 'x'; give a number"):
        clbrdf.evaluate({"rho": "x"}, 30.0, 30.0, 180.0, model="lambert")
    with pytest.raises(DeviceError, match="device is 99; give part of its name"):
        clbrdf.fit(fit.scan, device=99)
    assert clbrdf.fit(fit.scan, model="lambert", device="").search.device == fit.search.device
    with pytest.raises(InputError, match="3 indices; a scan has two"):
        fit.scan[0, 0, 0]
    with pytest.raises(InputError, match="wavelength is 'a'; give a number"):
        fit.scan.sel(wavelength="a")


def test_what_is_not_determined_has_no_finite_prediction(fit):
    sigma = np.array(fit.estimate.sigma)
    sigma[0, 0] = np.inf
    open_fit = replace(fit, estimate=replace(fit.estimate, sigma=sigma))
    assert np.isinf(open_fit.predict(return_std=True)[1][:, 0]).any()
    assert np.isfinite(open_fit.predict(return_std=True)[1][:, 1]).all()


def test_tables_of_other_libraries(scan, fit, tmp_path):
    pytest.importorskip("pandas", reason="pandas is not installed")
    pytest.importorskip("xarray", reason="xarray is not installed")
    table = fit.to_dataframe()
    for name in fit.model.names:
        np.testing.assert_array_equal(table[name], fit.parameters[name])
        np.testing.assert_array_equal(table[f"{name}_sigma"], fit.sigma[name])
    data = fit.to_xarray()
    chosen = data.brdf.sel(wavelength=600.0).where(data.theta_i == 40.0, drop=True)
    np.testing.assert_array_equal(chosen, scan.brdf[scan.theta_i == 40.0, 1])
    np.testing.assert_array_equal(data.sigma, scan.sigma)
    rows = scan.to_dataframe()
    assert len(rows) == scan.brdf.size
    one = rows[(rows.theta_i == 40.0) & (rows.theta_r == 30.0) & (rows.wavelength == 700.0)]
    assert one.brdf.item() == scan.sel(theta_i=40.0, theta_r=30.0, wavelength=700.0).brdf.item()
    fit.to_csv(tmp_path / "fit.csv")
    with open(tmp_path / "fit.csv", newline="", encoding="utf-8") as stream:
        told = list(csv.DictReader(stream))
    for name in fit.model.names:
        assert [float(row[name]) for row in told] == fit.parameters[name].tolist()
    assert [row["status"] for row in told] == fit.status.tolist()


def test_seeds_of_numpy_are_seeds(scan):
    a = clbrdf.fit(scan, model="minnaert", seed=np.int64(3))
    assert a.setup.seed == 3
    assert type(a.setup.seed) is int
    with pytest.raises(InputError, match=r"seed is 1\.5; give a whole number"):
        clbrdf.fit(scan, seed=1.5)


def test_advice_is_in_the_words_of_who_reads_it(scan, tmp_path, capsys):
    from clbrdf.cli import main

    path = tmp_path / "scan.h5"
    scan.save(path)
    with pytest.raises(InputError, match="give overwrite=True"):
        scan.save(path)
    assert main(["fit", str(path), "-o", str(path)]) == 2
    capsys.readouterr()
    assert main(["evaluate", "--theta-i", "30", "--theta-r", "30", "--json", str(path)]) == 2
    assert "add --overwrite" in capsys.readouterr().err
    with pytest.raises(InputError, match=r"fix=\{'n': "):
        clbrdf.fit(scan, model="rayleigh_rice")


def test_repeats_become_one(scan):
    """By hand: 1/σ² means of what is not masked, and their σ."""
    again = scan[scan.theta_i == 40.0]
    louder = replace(again, brdf=1.1 * again.brdf, sigma=2.0 * again.sigma)
    flags = np.array(again.flags)
    flags[0, 0] |= np.uint32(1)
    both = Scan.merge(
        [scan, louder, replace(again, flags=flags, brdf=9.0 * again.brdf, sigma=100.0 * again.sigma)]
    )
    mean = both.averaged()
    assert len(mean) == len(scan)
    assert mean.repeated_directions() == 0
    a, b, c = again.brdf[:, 1], 1.1 * again.brdf[:, 1], 9.0 * again.brdf[:, 1]
    s = again.sigma[:, 1] * np.array([[1.0], [2.0], [100.0]])
    expected = (np.stack([a, b, c]) / s**2).sum(axis=0) / (1.0 / s**2).sum(axis=0)
    there = mean.theta_i == 40.0
    np.testing.assert_allclose(mean.brdf[there, 1], expected, rtol=1e-12)
    np.testing.assert_allclose(mean.sigma[there, 1], (1.0 / s**2).sum(axis=0) ** -0.5, rtol=1e-12)
    # The masked repeat has no part in its mean.
    s0 = again.sigma[0, 0] * np.array([1.0, 2.0])
    two = np.average([again.brdf[0, 0], 1.1 * again.brdf[0, 0]], weights=s0**-2.0)
    assert mean.brdf[there, 0][0] == pytest.approx(two, rel=1e-12)
    np.testing.assert_allclose(mean.brdf[~there], scan.brdf[~there], rtol=1e-14)  # (g f)/g rounds
    assert scan.averaged() is scan
