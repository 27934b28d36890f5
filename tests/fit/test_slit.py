"""Fits behind a slit: the matrix, its normal equations, and what a scene's slit has hidden."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

import clbrdf
from clbrdf import Fit, InputError, Scan
from clbrdf.fit.problem import make_problem
from clbrdf.fit.slit import band_covariance, banded, reach_of, slit_equations, slit_matrix
from clbrdf.instrument.bandwidth import Bandwidth
from clbrdf.instrument.settings import Instrument
from clbrdf.models import get_model
from clbrdf.objective import weight_matrix
from clbrdf.scene import simulate
from tests.scene.scenes import scene

GRID = np.arange(400.0, 501.0, 5.0)


@pytest.mark.parametrize("shape", ["triangle", "rectangle", "gauss"])
def test_the_matrix_takes_means_over_the_slit(shape):
    """Of a cubic, which the four nearest points give exactly: plain integrals by SciPy."""
    settings = Bandwidth(width=8.0, shape=shape)
    matrix = slit_matrix(settings, GRID)

    def spectrum(nm):
        t = (nm - 450.0) / 50.0
        return 1.0 + 0.3 * t - 0.8 * t**2 + 0.5 * t**3

    sigma = 8.0 / np.sqrt(8.0 * np.log(2.0))
    weight = {
        "triangle": lambda d: max(0.0, 1.0 - abs(d) / 8.0),
        "rectangle": lambda d: float(abs(d) <= 4.0),
        "gauss": lambda d: np.exp(-((d / sigma) ** 2) / 2.0),
    }[shape]
    reach = {"triangle": 8.0, "rectangle": 4.0, "gauss": 5.0 * sigma}[shape]
    for row in (4, 10):
        top = quad(lambda d, nm=GRID[row]: weight(d) * spectrum(nm + d), -reach, reach, points=[0.0])[0]
        area = quad(weight, -reach, reach, points=[0.0])[0]
        # Nodes of a polynomial times the slit are exact but for the Gaussian, which 16 of them give to 1e-10.
        assert (matrix @ spectrum(GRID))[row] == pytest.approx(top / area, rel=1e-9)
    np.testing.assert_allclose(matrix.sum(axis=1), 1.0, rtol=1e-7)


def test_a_slit_finer_than_the_wavelengths_is_refused():
    with pytest.raises(InputError, match="4 nm is finer than the scan's wavelengths, which are 5 nm apart"):
        slit_matrix(Bandwidth(width=4.0), GRID)


def slit_scan(width, wavelength=GRID):
    """A Lambertian with a dark band 12 nm wide, under a broad lobe."""
    dip = [
        [nm, 0.6 - 0.4 * np.exp(-(((nm - 450.0) / 12.0) ** 2) / 2.0)] for nm in np.arange(350.0, 551.0, 1.0)
    ]
    parameters = {"ggx.alpha": 0.2, "ggx.F0": 0.05, "ggx.F90": 1.0, "lambert.rho": dip}
    scan = simulate(
        scene(
            [20.0, 50.0],
            {"start": 0.0, "stop": 70.0, "step": 10.0},
            wavelength=wavelength.tolist(),
            surface={"model": "ggx+lambert", "parameters": parameters},
            effects={"bandwidth": {"width": width}},
            rtol=1e-8,
        )
    )
    truth = np.interp(wavelength, *np.transpose(dip))
    noise = np.random.default_rng(1).normal(1.0, 0.002, scan.brdf.shape)
    return replace(scan, brdf=scan.brdf * noise, sigma=0.002 * scan.brdf), truth


def test_the_normal_equations_are_those_of_the_whole_system(device):
    """A dense system by differences of the residuals, all wavelengths at once."""
    model = get_model("ggx+lambert")
    scan, _ = slit_scan(12.0, GRID[:6])
    problem = make_problem(scan, weight_matrix(scan, "sigma"), model, model.bounds(), device)
    slit, noise = slit_matrix(Bandwidth(width=12.0), GRID[:6]), np.linspace(0.5, 2.0, 6)
    q = np.tile(model.to_coordinates(np.array([0.2, 0.06, 0.9, 0.5])), (6, 1))
    w, p = q.shape

    def residual(flat):
        values = model.brdf(model.from_coordinates(flat.reshape(w, p))[:, None, :], problem.features)
        return ((problem.scale * (slit @ values) - problem.target) / np.sqrt(noise)[:, None]).ravel()

    steps = 1e-5 * np.eye(w * p)
    J = np.stack([(residual(q.ravel() + s) - residual(q.ravel() - s)) / 2e-5 for s in steps], axis=1)
    found = slit_equations(problem, slit, noise, q)
    np.testing.assert_allclose((found.energy / noise).sum(), (residual(q.ravel()) ** 2).sum(), rtol=1e-12)
    # Central differences of 1e-5: an error of 1e-9 relative to the largest entry.
    gradient = J.T @ residual(q.ravel())
    np.testing.assert_allclose(found.gradient.ravel(), gradient, atol=1e-8 * np.abs(gradient).max())
    H = J.T @ J
    stiffness, held = np.full((w - 1, p), 0.3), np.zeros((w, p), dtype=bool)
    held[2, 1] = True
    ties = np.zeros_like(H)
    for v in range(w - 1):
        for j in range(p):
            a, b = v * p + j, (v + 1) * p + j
            ties[np.ix_([a, b], [a, b])] += 0.3 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    H += ties
    H[2 * p + 1, :], H[:, 2 * p + 1] = 0.0, 0.0
    H[2 * p + 1, 2 * p + 1] = 1.0
    assert reach_of(slit) > 1
    band = banded(found.blocks, stiffness, held)
    dense = np.zeros_like(H)
    for below in range(len(band)):
        for k in range(w * p - below):
            dense[k + below, k] = dense[k, k + below] = band[below, k]
    np.testing.assert_allclose(dense, H, atol=1e-8 * np.abs(H).max())
    inverse = np.linalg.inv(dense)
    expected = np.stack([inverse[v * p : (v + 1) * p, v * p : (v + 1) * p] for v in range(w)])
    np.testing.assert_allclose(
        band_covariance(band, p), expected, rtol=1e-6, atol=1e-9 * np.abs(expected).max()
    )


def test_a_band_that_the_slit_has_filled_comes_back(tmp_path, device):
    scan, truth = slit_scan(15.0)
    assert scan.bandpass is not None
    options = {"model": "ggx+lambert", "weights": "sigma", "fix": {"ggx.F90": 1.0}, "smooth": 0.05}
    through, point = clbrdf.fit(scan, **options), clbrdf.fit(scan, through="point", **options)
    assert through.through is not None
    inside = slice(4, -4)  # at the ends the slit reaches beyond what was measured
    off = np.abs(through.parameters["lambert.rho"] / truth - 1.0)[inside].max()
    off_of_points = np.abs(point.parameters["lambert.rho"] / truth - 1.0)[inside].max()
    # The slit fills the band by 15²/12 · f'', more than 10 %. To undo it makes five times of 0.2 % noise.
    assert off_of_points > 0.1
    assert off < 0.04
    np.testing.assert_allclose(through.observed()[:, inside], scan.brdf[:, inside], rtol=0.02)
    through.save(tmp_path / "fit.h5")
    np.testing.assert_array_equal(Fit.open(tmp_path / "fit.h5").observed(), through.observed())


def test_a_bandwidth_asks_for_a_smooth_fit(device):
    scan, _ = slit_scan(15.0)
    told = Instrument(bandwidth=Bandwidth(width=15.0))
    with pytest.raises(InputError, match="bandwidth ties neighbouring wavelengths; add smooth"):
        clbrdf.fit(scan, through=told)
    # What the scan says is left out where the fit cannot take it.
    assert clbrdf.fit(scan, model="lambert").through is None
    finer = Scan(scan.theta_i, 0.0, scan.theta_r, scan.phi_r, scan.wavelength, scan.brdf, bandpass=2.0)
    assert clbrdf.fit(finer, model="lambert", smooth=0.1).through is None
