"""The parts of the microfacet references: distributions, shadowing and Fresnel reflectance."""

from __future__ import annotations

import numpy as np
import pytest
from mpmath import (
    acos,
    asin,
    atan,
    cot,
    fabs,
    mp,
    mpf,
    pi,
    quad,
    radians,
)
from mpmath import cos as mcos
from mpmath import sin as msin
from mpmath import tan as mtan

from tests.reference.integrals import nodes
from tests.reference.models import REFERENCES, beckmann, fresnel, ggx
from tests.reference.models.domain import HARD_DIRECTIONS
from tests.reference.models.geometry import dot

ROUGHNESSES = [(0.1, 0.1), (0.7, 0.7), (0.3, 0.6)]
DISTRIBUTIONS = {"ggx": (ggx.distribution, ggx.smith), "beckmann": (beckmann.distribution, beckmann.smith)}


def normal(theta, phi):
    return msin(theta) * mcos(phi), msin(theta) * msin(phi), mcos(theta)


@pytest.mark.parametrize("name", DISTRIBUTIONS)
@pytest.mark.parametrize("alpha", ROUGHNESSES)
def test_facets_cover_the_plane_once(name, alpha):
    """∫ D cosθ dω = 1; the trapezoidal rule in φ converges exponentially."""
    distribution, _ = DISTRIBUTIONS[name]
    with mp.workdps(20):
        turns = 32 if alpha[0] != alpha[1] else 1
        total = mpf(0)
        for k in range(turns):
            phi = pi * k / turns
            total += quad(
                lambda t, phi=phi: distribution(normal(t, phi), *alpha) * mcos(t) * msin(t),
                [0, atan(mpf(alpha[0])), atan(3 * mpf(alpha[1])), pi / 2],
            )
        assert float(total * 2 * pi / turns) == pytest.approx(1.0, rel=1e-10)


@pytest.mark.parametrize("name", DISTRIBUTIONS)
@pytest.mark.parametrize("alpha", [(0.7, 0.7), (0.3, 0.6)])
@pytest.mark.parametrize("direction", [(60.0, 0.0), (75.0, 40.0)])
def test_visible_facets_fill_the_view(name, alpha, direction):
    """∫ G1 max(0, o·h) D dω = cosθo is what makes Λ Smith's."""
    distribution, smith = DISTRIBUTIONS[name]
    theta_o, phi_o = (radians(mpf(angle)) for angle in direction)
    view = normal(theta_o, phi_o)
    total = mpf(0)
    with mp.workdps(18):
        thetas, weights = nodes([0.0, np.pi / 2 - float(theta_o), np.pi / 2], 40)
        for theta, weight in zip(thetas, weights, strict=True):
            # Facets beyond this azimuth from the view are turned away from it.
            limit = -cot(theta_o) * cot(mpf(theta))
            seen = float(acos(limit)) if limit > -1 else np.pi
            for u, w in zip(*nodes([-1.0, 0.0, 1.0], 20), strict=True):
                h = normal(mpf(theta), phi_o + mpf(u * seen))
                total += weight * w * seen * msin(mpf(theta)) * dot(view, h) * distribution(h, *alpha)
        # The limit starts like a square root, which costs Gauss-Legendre some digits.
        assert float(total / (1 + smith(view, *alpha))) == pytest.approx(float(mcos(theta_o)), rel=1e-5)


@pytest.mark.parametrize("name", ["ggx", "beckmann"])
def test_nothing_is_clamped(name):
    """Renderers hold α above 1e-4 and cut small values off; a reference must do neither."""
    parameters = {"alpha": 1e-6, "F0": 1.0, "F90": 1.0}
    peak = REFERENCES[name].value(parameters, 60.0, 0.0, 60.0, 180.0)
    # D = 1/(πα²) and no shadowing to speak of: 1/(4πα² cos²θ).
    assert float(peak) == pytest.approx(1 / (np.pi * 1e-12), rel=1e-10)
    assert REFERENCES[name].value(parameters, 60.0, 0.0, 60.0, 0.0) > 0


@pytest.mark.parametrize("kind", ["ggx", "ward"])
def test_equal_roughnesses_are_the_isotropic_model(kind):
    rest = {"F0": 0.2, "F90": 0.9} if kind == "ggx" else {"rho_s": 0.4}
    for angles in HARD_DIRECTIONS.values():
        one = REFERENCES[kind].value({"alpha": 0.3, **rest}, *angles)
        two = REFERENCES[f"{kind}_anisotropic"].value({"alpha_x": 0.3, "alpha_y": 0.3, **rest}, *angles)
        assert fabs(one - two) <= fabs(one) * mpf(10) ** -60


@pytest.mark.parametrize("kind", ["ggx", "ward"])
def test_a_quarter_turn_swaps_the_roughnesses(kind):
    rest = {"F0": 0.2, "F90": 0.9} if kind == "ggx" else {"rho_s": 0.4}
    model = REFERENCES[f"{kind}_anisotropic"]
    one = model.value({"alpha_x": 0.1, "alpha_y": 0.4, **rest}, 50.0, 20.0, 35.0, 155.0)
    two = model.value({"alpha_x": 0.4, "alpha_y": 0.1, **rest}, 50.0, 110.0, 35.0, 245.0)
    assert fabs(one - two) <= fabs(one) * mpf(10) ** -60
    # Slopes spread along x where alpha_x is the larger: light in that plane then leaves its mirror direction.
    wide, narrow = (
        model.value({"alpha_x": a, "alpha_y": 0.5 - a, **rest}, 30.0, 0.0, 60.0, 180.0) for a in (0.4, 0.1)
    )
    assert wide > narrow


def test_reflectance_at_normal_incidence():
    n, k = mpf("1.37"), mpf("7.6")
    expected = ((n - 1) ** 2 + k**2) / ((n + 1) ** 2 + k**2)
    for value in fresnel.polarised(mpf(1), n, k):
        assert fabs(value - expected) < mpf(10) ** -55
    # Both normal, unit slope: D / 4 is all that stands beside F.
    model = REFERENCES["ggx_conductor"].value({"alpha": 1.0, "n": 1.37, "k": 7.6, "scale": 1.0}, 0, 0, 0, 0)
    assert float(model * 4 * pi) == pytest.approx(float(expected), rel=1e-15)


def test_no_p_light_at_brewsters_angle():
    n = mpf("1.5")
    s, p = fresnel.polarised(mcos(atan(n)), n, mpf(0))
    assert p < mpf(10) ** -100
    assert fabs(s - ((n**2 - 1) / (n**2 + 1)) ** 2) < mpf(10) ** -55
    assert fabs(fresnel.unpolarised(mcos(atan(n)), n, mpf(0)) - s / 2) < mpf(10) ** -55


def test_everything_is_reflected_at_grazing_incidence():
    for k in (0, 3):
        assert fresnel.unpolarised(mpf(10) ** -20, mpf("1.5"), mpf(k)) > 1 - mpf(10) ** -18


def test_a_dielectric_against_the_real_formulas_of_sines_and_tangents():
    n, theta = mpf("1.8"), radians(mpf(52))
    inside = asin(msin(theta) / n)
    s, p = fresnel.polarised(mcos(theta), n, mpf(0))
    assert fabs(s - (msin(theta - inside) / msin(theta + inside)) ** 2) < mpf(10) ** -55
    assert fabs(p - (mtan(theta - inside) / mtan(theta + inside)) ** 2) < mpf(10) ** -55


def test_schlick_meets_f0_and_f90():
    assert fresnel.schlick(mpf(1), mpf("0.1"), mpf("0.8")) == mpf("0.1")
    assert fabs(fresnel.schlick(mpf(0), mpf("0.1"), mpf("0.8")) - mpf("0.8")) < mpf(10) ** -55
    assert fabs(fresnel.schlick(mpf("0.5"), mpf(0), mpf(1)) - mpf(1) / 32) < mpf(10) ** -55


@pytest.mark.parametrize("kind", ["ggx", "beckmann"])
def test_a_conductor_without_absorption_is_a_dielectric(kind):
    for angles in HARD_DIRECTIONS.values():
        dielectric = REFERENCES[f"{kind}_dielectric"].value({"alpha": 0.2, "n": 1.6, "scale": 0.9}, *angles)
        conductor = REFERENCES[f"{kind}_conductor"].value(
            {"alpha": 0.2, "n": 1.6, "k": 0.0, "scale": 0.9}, *angles
        )
        assert fabs(dielectric - conductor) <= fabs(dielectric) * mpf(10) ** -60
