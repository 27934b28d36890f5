"""Geometry against vectors in many digits; maps of densities against numerical integrals."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clbrdf.formats.rgl.coordinates import (
    azimuth_coordinate,
    azimuth_of,
    half_vector,
    horizon,
    reflected,
    zenith_coordinate,
    zenith_of,
)
from clbrdf.formats.rgl.warp import Mixture, Warp

ANGLE = st.floats(0.0, 89.9)


def half_exact(theta_i, theta_r, phi):
    with mpmath.workdps(40):
        i, r, p = (mpmath.mpf(float(a)) for a in (theta_i, theta_r, phi))
        x = mpmath.sin(i) + mpmath.sin(r) * mpmath.cos(p)
        y = mpmath.sin(r) * mpmath.sin(p)
        z = mpmath.cos(i) + mpmath.cos(r)
        return float(mpmath.atan2(mpmath.hypot(x, y), z)), float(mpmath.atan2(y, x))


@given(ANGLE, ANGLE, st.floats(0.0, 360.0))
def test_half_vector_keeps_its_digits(theta_i, theta_r, phi):
    angles = [np.array([np.deg2rad(a)]) for a in (theta_i, theta_r, phi)]
    theta_m, phi_m = half_vector(*angles)
    exact = half_exact(*(a[0] for a in angles))
    # π itself is rounded, by 1.2e-16: at the mirror direction that is all there is of θm.
    assert theta_m[0] == pytest.approx(exact[0], rel=1e-14, abs=4e-16)
    if exact[0] > 1e-9:
        assert abs(np.exp(1j * phi_m[0]) - np.exp(1j * exact[1])) < 1e-6


@given(st.floats(0.0, 89.0), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_reflection_at_a_half_vector_has_that_half_vector(theta_i, x, y):
    incident = np.deg2rad(theta_i)
    theta_m, phi_m = zenith_of(np.array([x])), azimuth_of(np.array([y]))
    _, cosine, phi = reflected(incident, theta_m, phi_m)
    above = theta_m < horizon(np.array([incident]), phi_m)
    assert above[0] == (cosine[0] > 0.0) or abs(cosine[0]) < 1e-12
    if cosine[0] > 1e-3 and theta_m[0] > 1e-3:
        back, turn = half_vector(np.array([incident]), np.arccos(cosine), phi)
        assert back[0] == pytest.approx(theta_m[0], abs=1e-9)
        assert abs(np.exp(1j * turn[0]) - np.exp(1j * phi_m[0])) < 1e-6


def test_coordinates_and_back():
    u = np.linspace(0.0, 1.0, 101)
    np.testing.assert_allclose(zenith_coordinate(zenith_of(u)), u, atol=1e-15)
    np.testing.assert_allclose(azimuth_coordinate(azimuth_of(u[:-1])), u[:-1], atol=1e-15)
    assert azimuth_coordinate(np.array([np.pi]))[0] == 0.0


def made(seed, stack=2, rows=4, columns=5):
    density = np.random.default_rng(seed).random((stack, rows, columns)) + 0.05
    density[0, :, -2:] = 0.0  # as below a horizon
    return density


def value(density, x, y):
    """Bilinear density at one point."""
    rows, columns = density.shape
    gx, gy = x * (columns - 1), y * (rows - 1)
    px, py = min(int(gx), columns - 2), min(int(gy), rows - 2)
    fx, fy = gx - px, gy - py
    low = (1 - fx) * density[py, px] + fx * density[py, px + 1]
    high = (1 - fx) * density[py + 1, px] + fx * density[py + 1, px + 1]
    return (1 - fy) * low + fy * high


@pytest.mark.parametrize("weight", [0.0, 0.3, 1.0])
def test_shares_are_integrals_of_the_mixed_density(weight):
    density = made(1)
    warp = Warp.of(density)
    mixed = sum(
        w * d / (np.trapezoid(np.trapezoid(d))) for w, d in zip((1 - weight, weight), density, strict=True)
    )
    x, y = np.array([0.37, 0.62, 0.05]), np.array([0.81, 0.2, 0.5])
    mixture = Mixture(np.array([[0] * 3, [1] * 3]), np.array([[1 - weight] * 3, [weight] * 3]))
    share_x, share_y = warp.share(mixture, x, y)
    fine = np.linspace(0.0, 1.0, 2001)
    for k in range(3):
        line = np.array([value(mixed, u, y[k]) for u in fine])
        left = np.array([value(mixed, u, y[k]) for u in fine * x[k]])
        # The trapezoids of 2000 steps of a piecewise linear function: exact but in the cells of its kinks.
        assert share_x[k] == pytest.approx(left.mean() * x[k] / line.mean(), abs=2e-3)
        rows = np.array([[value(mixed, u, v) for u in np.linspace(0, 1, 81)] for v in np.linspace(0, 1, 81)])
        total, below = rows.mean(axis=1), np.linspace(0, 1, 81) <= y[k]
        assert share_y[k] == pytest.approx(total[below].sum() / total.sum(), abs=2e-2)


@given(st.integers(0, 50))
def test_places_have_the_shares_asked_for(seed):
    warp = Warp.of(made(seed))
    for layer in (0, 1):
        shares = np.linspace(0.0, 1.0, 9)
        x, y = warp.place(layer, shares, shares)
        assert x.shape == (9, 9)
        flat = np.broadcast_to(y[:, None], x.shape).ravel()
        mixture = Mixture(np.full((1, 81), layer), np.ones((1, 81)))
        share_x, share_y = warp.share(mixture, x.ravel(), flat)
        # Shares are kept 2^-24 from the ends.
        np.testing.assert_allclose(share_x.reshape(9, 9), np.tile(shares, (9, 1)), atol=1e-7)
        np.testing.assert_allclose(share_y.reshape(9, 9), np.tile(shares, (9, 1)).T, atol=1e-7)
    # Where the density is 0 nobody is sent: the last two columns of the first layer.
    assert warp.place(0, np.ones(1), shares)[0].max() <= 0.75 + 1e-12
