"""Closed forms of the linear parameters against SciPy's solvers."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import lsq_linear, nnls

from clbrdf.fit.reduced import Sums, best_amplitudes, best_linear

W, N, K, I = 3, 60, 5, 4  # noqa: E741 (incident directions, as in the module)


@pytest.fixture(params=["shared scale", "own scales"])
def case(request):
    rng = np.random.default_rng(21)
    group = np.sort(rng.integers(0, I, N))
    lobes = rng.uniform(0.0, 2.0, (K, N)) ** 3
    truth = rng.uniform(0.1, 1.0, (W, I))
    data = truth[:, group] * lobes[:W] + 0.1 + 0.05 * rng.standard_normal((W, N))
    scale = np.ones((W, N)) if request.param == "shared scale" else rng.uniform(0.5, 2.0, (W, N))
    scale[:, 7] = 0.0  # masked
    scale *= np.array([[1.0], [3.0], [0.2]])
    return data * scale, scale, lobes, group


def columns(scale, lobes, group):
    """One column an amplitude, and one of the diffuse term."""
    masks = [(group == i) for i in range(I)]
    return np.stack([*(scale * lobes * m for m in masks), scale], axis=1)


def test_amplitudes_are_those_of_non_negative_least_squares(case):
    target, scale, lobes, group = case
    energy, amplitudes = best_amplitudes(Sums.project(target, scale, lobes, group))
    exact = 0
    for w in range(W):
        unit = scale[w].max() ** 2
        for k in range(K):
            expected, norm = nnls(columns(scale[w], lobes[k], group), target[w])
            # Two passes find the active set in most cases; never anything below the minimum.
            assert energy[w, k] * unit >= norm**2 * (1.0 - 1e-10)
            if energy[w, k] * unit <= norm**2 * (1.0 + 1e-10):
                np.testing.assert_allclose(amplitudes[:, w, k], expected[:I], atol=1e-9)
                exact += 1
    assert exact >= 0.8 * W * K


@pytest.mark.parametrize("limits", [(10.0, 10.0), (0.2, 10.0), (10.0, 0.05), (0.1, 0.05)])
def test_linear_parameters_are_those_of_bounded_least_squares(case, limits):
    target, scale, lobes, group = case
    sums = Sums.project(target, scale, lobes, group)
    rng = np.random.default_rng(22)
    growth = rng.uniform(0.1, 1.0, (I, W, K, 2))
    energy, weight, rest = best_linear(sums, growth, np.full((W, K, 2), limits[0]), limits[1])
    for w in range(W):
        for k in range(K):
            for v in range(2):
                lobe = scale[w] * lobes[k] * growth[group, w, k, v]
                system = np.stack([lobe, scale[w]], axis=1)
                end = lsq_linear(system, target[w], bounds=([0.0, 0.0], limits), tol=1e-14)
                # lsq_linear ends near a bound, not on it: good to its tolerance.
                np.testing.assert_allclose(
                    energy[w, k, v] * scale[w].max() ** 2, 2.0 * end.cost, rtol=1e-8, atol=1e-12
                )
                np.testing.assert_allclose([weight[w, k, v], rest[w, k, v]], end.x, atol=1e-5)
