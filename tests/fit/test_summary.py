"""Sums of a fit's summary against NumPy on the values themselves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clbrdf.fit.layout import layout_of
from clbrdf.fit.problem import make_problem
from clbrdf.fit.summary import summarise_scan
from clbrdf.models import get_model
from clbrdf.objective import objective, relative_rms, relative_rms_by_incident_angle, weight_matrix

MODEL = "ggx+minnaert"


@pytest.fixture
def spoiled(small_scan):
    """Noise, masked values, one unknown uncertainty, and directions in no order."""
    rng = np.random.default_rng(7)
    values = small_scan.brdf * (1.0 + 0.1 * rng.standard_normal(small_scan.brdf.shape))
    values[[3, 17], 0] = np.nan
    sigma = 0.05 * small_scan.brdf
    sigma[5, 2] = np.nan
    return replace(small_scan, brdf=values, sigma=sigma, flags=None).rows(rng.permutation(len(small_scan)))


@pytest.mark.parametrize("weights", ["none", "relative", "sigma", "some"])
@pytest.mark.parametrize("name", [MODEL, "wang2013", "lambert"])
def test_sums_are_those_of_numpy(spoiled, device, weights, name):
    scan, model = spoiled, get_model(name)
    given = (np.arange(len(scan)) % 5 > 0).astype(float) if weights == "some" else weights
    g = weight_matrix(scan, given)
    layout, w = layout_of(model, scan.directions), len(scan.wavelength)
    vector = np.repeat(model.defaults[None], w, axis=0) * (1.0 + 0.1 * np.arange(w)[:, None])
    if name == "wang2013":
        vector[0, model.names.index("ks")] = 0.0  # where the kernel's derivative is no number

    def problem_of(places):
        return make_problem(scan, g, model, model.bounds(), device, layout=layout, places=places)

    sums = summarise_scan(scan, g, layout, problem_of, np.arange(w), vector)
    x = model.features(scan.directions)
    f = model.brdf(vector[:, None], x).T
    # Double precision throughout; kernels keep 1e-12 of a value, and differences lose a digit or two.
    np.testing.assert_allclose(sums.objective, objective(f, scan, g), rtol=1e-10)
    rms = np.sqrt(sums.deviation.sum(axis=1) / sums.counted.sum(axis=1))
    np.testing.assert_allclose(rms, relative_rms(f, scan), rtol=1e-10)
    by_angle = np.sqrt(sums.deviation / sums.counted).T
    np.testing.assert_allclose(by_angle, relative_rms_by_incident_angle(f, scan), rtol=1e-10)
    assert sums.used.tolist() == (g > 0.0).sum(axis=0).tolist()
    for k in range(w):
        used = g[:, k] > 0.0
        norm = (g[used, k] * scan.brdf[used, k] ** 2).sum()
        J = model.jacobian(vector[k, None], x)[used]
        G = (J.T * g[used, k]) @ J / norm
        np.testing.assert_allclose(sums.gram[k], G, rtol=1e-9, atol=1e-11 * np.abs(G).max())
        assert sums.peak[k] == pytest.approx(f[used, k].max(), rel=1e-11)
        known = np.isfinite(scan.sigma[used, k]).all()
        assert np.isfinite(sums.spread[k]).all() == known
        if known:
            S = (J.T * (g[used, k] * scan.sigma[used, k]) ** 2) @ J / norm**2
            np.testing.assert_allclose(sums.spread[k], S, rtol=1e-9, atol=1e-11 * np.abs(S).max())
