"""The references themselves, against closed forms, integrals and printed numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mpmath import (
    asin,
    degrees,
    fabs,
    hyp2f1,
    mp,
    mpf,
    pi,
    quad,
    radians,
)
from mpmath import cos as mcos
from mpmath import sin as msin

from tests.reference.integrals import WAVELENGTH, nodes, reflectance
from tests.reference.models import REFERENCES, eon, fresnel, hapke, rayleigh_rice, ross_li
from tests.reference.models.domain import HARD_DIRECTIONS
from tests.reference.models.geometry import Geometry


def test_lambert_reflects_rho():
    assert reflectance("lambert", {"rho": 0.37}, 25.0, [], []) == pytest.approx(0.37, rel=1e-14)


@pytest.mark.parametrize("k", [0.3, 1.0, 1.7])
def test_minnaert_reflects_rho_at_normal_incidence(k):
    # The integrand is cos^k θ sinθ, whose end at 90° is not smooth: Gauss-Legendre is left with 1e-5.
    assert reflectance("minnaert", {"rho": 0.6, "k": k}, 0.0, [80, 88, 89.8], []) == pytest.approx(
        0.6, rel=1e-5
    )


@pytest.mark.parametrize("theta_i", [0.0, 30.0, 75.0])
@pytest.mark.parametrize("r", [0.0, 1e-9, 0.4, 1.0])
def test_eon_passes_the_furnace(theta_i, r):
    # The lobe has a kink at φ = 90° and at θr = θi; between them it is smooth.
    breaks = [theta_i] if theta_i else []
    assert reflectance("eon", {"rho": 1.0, "r": r}, theta_i, breaks, [90.0], 16) == pytest.approx(
        1.0, rel=1e-8
    )


def test_eon_reflects_what_facets_pass_on_to_each_other():
    """Light that one reflection loses meets the surface again, with rho at every meeting."""
    rho, r, theta_i = 0.5, 1.0, 60.0
    first = float(eon.directional_albedo(radians(mpf(theta_i)), mpf(r)))
    mean = float(eon.average_albedo(mpf(r)))
    later = sum(rho ** (2 + k) * mean * (1 - mean) ** k for k in range(60))
    total = reflectance("eon", {"rho": rho, "r": r}, theta_i, [theta_i], [90.0], 16)
    assert total == pytest.approx(rho * first + later * (1 - first), rel=1e-8)


@pytest.mark.parametrize(
    ("sigma2", "theta", "expected"),
    # By hand: A = 1 − 0.5 · ½ along the normal; A + 0.45 · ½ · sin 45° tan 45° in the hot spot of 45°.
    [(0.33, 0.0, 0.75), (0.09, 45.0, 1 - 0.045 / 0.42 + 0.225 * 0.5**0.5)],
)
def test_oren_and_nayar_by_hand(sigma2, theta, expected):
    value = REFERENCES["oren_nayar"].value({"rho": 1.0, "sigma": sigma2**0.5}, theta, 0.0, theta, 0.0)
    assert float(value * pi) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize("theta", [20.0, 80.0])
def test_directional_albedo_of_the_first_lobe_of_eon(theta):
    thetas, theta_weights = nodes([0.0, theta, 90.0], 16)
    phis, phi_weights = nodes([0.0, 90.0, 180.0], 16)
    total = 0.0
    for theta_r, theta_weight in zip(thetas, theta_weights, strict=True):
        solid = np.sin(np.deg2rad(theta_r)) * np.cos(np.deg2rad(theta_r)) * theta_weight
        values = [float(eon.fujii(Geometry(theta, 0.0, theta_r, phi), mpf(1), mpf(0.7))) for phi in phis]
        total += 2 * solid * np.dot(values, phi_weights) * np.deg2rad(1.0) ** 2
    assert total == pytest.approx(float(eon.directional_albedo(radians(mpf(theta)), mpf(0.7))), rel=1e-10)


def test_average_albedo_of_the_first_lobe_of_eon():
    r = mpf("0.7")
    mean = quad(lambda t: 2 * eon.directional_albedo(t, r) * msin(t) * mcos(t), [0, pi / 2])
    assert float(fabs(mean - eon.average_albedo(r))) < 1e-30


def _scatter_at_normal_incidence(name, parameters, knee):
    """2π ∫ f x dx with x = sinθ, in 20 digits."""
    reference = replace(REFERENCES[name], digits=30)

    def integrand(x):
        return reference.value(parameters, 0.0, 0.0, degrees(asin(x)), 180.0) * x

    with mp.workdps(20):
        # f is a power of x on either side of the knee: equal steps of its logarithm.
        return float(2 * pi * quad(integrand, [0, knee / 10, knee, min(10 * knee, 1), 1]))


@pytest.mark.parametrize("x_k", [0.01, 0.5])
@pytest.mark.parametrize("g", [0.5, 1.3, 2.0, 3.5])
def test_total_scatter_of_abg(x_k, g):
    B = x_k**g
    expected = float(pi * hyp2f1(1, 2 / mpf(g), 1 + 2 / mpf(g), -1 / mpf(B))) * 0.3  # A/B = b0
    # tanh-sinh in 20 digits; the knee is smooth.
    assert _scatter_at_normal_incidence("abg", {"b0": 0.3, "x_k": x_k, "g": g}, x_k) == pytest.approx(
        expected, rel=1e-12
    )


@pytest.mark.parametrize("length", [0.01, 0.5])
@pytest.mark.parametrize("C", [1.0, 2.0, 3.7])
def test_total_scatter_of_kcorr(length, C):
    if C == 2.0:
        expected = np.pi * 0.3 * length**2 * np.log1p(length**-2)
    else:
        p = 1 - C / 2
        expected = np.pi * 0.3 * length**2 * np.expm1(p * np.log1p(length**-2)) / p
    measured = _scatter_at_normal_incidence("kcorr", {"b0": 0.3, "l": length, "C": C}, length)
    assert measured == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("alpha", [0.05, 0.2, 0.5])
@pytest.mark.parametrize("theta_i", [0.0, 45.0, 80.0])
def test_ward_keeps_energy(alpha, theta_i):
    width = np.rad2deg(2 * alpha)
    thetas = sorted(
        {min(max(theta_i + d, 1.0), 89.0) for d in (-2 * width, -width / 2, width / 2, 2 * width)}
    )
    total = reflectance("ward", {"rho_s": 1.0, "alpha": alpha}, theta_i, thetas, [90.0, 150.0, 170.0], 12)
    # The bound is 1; 0.1 % for the quadrature.
    assert 0.2 < total < 1.001
    if theta_i == 0.0 and alpha == 0.05:
        assert total == pytest.approx(1.0, abs=0.01)  # a small α loses only what goes below the horizon


@pytest.mark.parametrize("name", ["ggx", "beckmann"])
@pytest.mark.parametrize("theta_i", [0.0, 60.0])
def test_facets_without_losses_keep_energy(name, theta_i):
    breaks = [15.0, 30.0, 45.0, 60.0, 75.0]
    total = reflectance(name, {"alpha": 0.2, "F0": 1.0, "F90": 1.0}, theta_i, breaks, [90.0, 150.0], 12)
    # What is missing is light that should leave after a second reflection. At normal incidence GGX sends at
    # least 1/(1 + 1/α²), 4 %, below the horizon: its facets steeper than 45°.
    assert 0.85 < total < (0.97 if name == "ggx" and theta_i == 0.0 else 1.0)


@pytest.mark.parametrize("theta", [0.0, 40.0, 85.0])
def test_rayleigh_rice_in_the_mirror_direction_has_fresnels_reflectances(theta):
    ss, ps, sp, pp = rayleigh_rice.polarisation_factors(
        Geometry(theta, 0.0, theta, 180.0), mpf("1.4"), mpf("2.3")
    )
    s, p = fresnel.polarised(mcos(radians(mpf(theta))), mpf("1.4"), mpf("2.3"))
    assert fabs(ss - s) < mpf(10) ** -50
    assert fabs(pp - p) < mpf(10) ** -50
    assert max(ps, sp) < mpf(10) ** -100


def test_rayleigh_rice_of_a_perfect_conductor():
    g = Geometry(40.0, 0.0, 65.0, 110.0)
    ss, ps, sp, pp = rayleigh_rice.polarisation_factors(g, mpf(10) ** 40, mpf(10) ** 40)
    cos_s, sin_s = mcos(radians(mpf(70))), msin(radians(mpf(70)))
    expected = [cos_s, sin_s / g.cos_i, sin_s / g.cos_r, (g.sin_i * g.sin_r - cos_s) / (g.cos_i * g.cos_r)]
    for value, root in zip((ss, ps, sp, pp), expected, strict=True):
        assert fabs(value - root**2) < mpf(10) ** -35


def test_total_scatter_of_rayleigh_rice():
    """R (4πσ/λ)² at normal incidence, where all is scattered near the mirror direction; σ from the PSD."""
    A, B, C, n, k = 1e-3, 1e4, 4.0, 1.4, 2.3
    parameters = {"A": A, "B": B, "C": C, "n": n, "k": k}
    reference = replace(REFERENCES["rayleigh_rice"], digits=30)
    knee = WAVELENGTH / 1000 / B
    x, weights = nodes([0.0, *(knee * 10.0**power for power in (-1, 0, 1, 2, 3, 4))], 20)
    angles = np.rad2deg(np.arcsin(x))
    values = [float(reference.value(parameters, 0.0, 0.0, theta, 180.0, WAVELENGTH)) for theta in angles]
    sigma2 = 2 * np.pi * A / ((C - 2) * B**2)
    R = ((n - 1) ** 2 + k**2) / ((n + 1) ** 2 + k**2)
    # Beyond x = 0.6 and off the mirror direction 1e-8 is left of a PSD that falls like f^-4.
    expected = R * (4 * np.pi / (WAVELENGTH / 1000)) ** 2 * sigma2
    assert 2 * np.pi * np.dot(values, weights * x) == pytest.approx(expected, rel=1e-6)


def test_rayleigh_rice_scales_with_the_wavelength():
    """Far out on a PSD that falls like f^-C the BRDF falls like λ^(C−4)."""
    parameters = {"A": 1e-3, "B": 1e6, "C": 3.0, "n": 1.5, "k": 2.0}
    values = [
        REFERENCES["rayleigh_rice"].value(parameters, 20.0, 0.0, 70.0, 90.0, w) for w in (500.0, 1000.0)
    ]
    assert float(values[0] / values[1]) == pytest.approx(2.0, rel=1e-10)


def test_abg_and_kcorr_meet():
    for angles in HARD_DIRECTIONS.values():
        abg = REFERENCES["abg"].value({"b0": 3.0, "x_k": 0.02, "g": 2.0}, *angles)
        kcorr = REFERENCES["kcorr"].value({"b0": 3.0, "l": 0.02, "C": 2.0}, *angles)
        assert fabs(abg - kcorr) <= abg * mpf(10) ** -60


def test_ross_li_kernels_in_known_directions():
    nadir, forward = Geometry(0, 0, 0, 0), Geometry(60.0, 0.0, 60.0, 180.0)
    assert fabs(ross_li.ross_thick(nadir)) < mpf(10) ** -25  # acos near 1 costs half the digits
    assert fabs(ross_li.li_sparse_reciprocal(nadir)) < mpf(10) ** -25
    # The crowns' shadows do not overlap, t = 0: −4 + ½ (1 + cos 120°) 4.
    assert fabs(ross_li.li_sparse_reciprocal(forward) + 3) < mpf(10) ** -25
    # In the hot spot of 60° both shadows fall together, t = 90°: 2 − 4 + ½ · 2 · 4, and sin 0 + π/2 for K_v.
    hot = Geometry(60.0, 0.0, 60.0, 0.0)
    assert fabs(ross_li.li_sparse_reciprocal(hot) - 2) < mpf(10) ** -25
    assert fabs(ross_li.ross_thick(hot) - pi / 4) < mpf(10) ** -25


@pytest.mark.parametrize(("weights", "printed"), [((0, 1, 0), 0.189184), ((0, 0, 1), -1.377622)])
def test_white_sky_integrals_of_the_kernels(weights, printed):
    """Lucht et al. 2000, doi:10.1109/36.841980, print them to six places."""
    parameters = dict(zip(("f_iso", "f_vol", "f_geo"), weights, strict=True))
    thetas, theta_weights = nodes([0.0, 90.0], 10)
    total = 0.0
    for theta, weight in zip(thetas, theta_weights, strict=True):
        black_sky = reflectance("ross_li", parameters, theta, [theta], [30.0, 90.0], 10)
        total += 2 * np.sin(np.deg2rad(theta)) * np.cos(np.deg2rad(theta)) * np.deg2rad(weight) * black_sky
    # Kinks where the shadows part leave the quadrature with 1e-3.
    assert total == pytest.approx(printed, rel=2e-3)


def test_rpv_without_its_factors_is_lambert():
    value = REFERENCES["rpv"].value(
        {"rho0": 0.3, "k": 1.0, "Theta": 0.0, "rho_c": 1.0}, 40.0, 0.0, 25.0, 70.0
    )
    assert float(value * pi) == pytest.approx(0.3, rel=1e-15)


def test_rpv_with_negative_theta_scatters_backward():
    parameters = {"rho0": 0.3, "k": 1.0, "Theta": -0.3, "rho_c": 1.0}
    back, forward = (REFERENCES["rpv"].value(parameters, 40.0, 0.0, 40.0, phi) for phi in (0.0, 180.0))
    # (1 − Θ²)/(1 − |Θ|)³ in the hot spot; the phase angle of the other is 80°.
    assert float(back * pi / 0.3) == pytest.approx(0.91 / 0.7**3, rel=1e-14)
    assert forward < back


def test_rpvs_hot_spot_fades_with_the_distance():
    # tan 45° + tan 45° = 2 in the forward direction.
    value = REFERENCES["rpv"].value(
        {"rho0": 0.3, "k": 1.0, "Theta": 0.0, "rho_c": 0.4}, 45.0, 0.0, 45.0, 180.0
    )
    assert float(value * pi / 0.3) == pytest.approx(1 + 0.6 / 3, rel=1e-15)


SMOOTH = {"b": 0.0, "c": 0.5, "theta_bar": 0.0, "h": 0.1, "B0": 0.0}


@pytest.mark.parametrize("theta_i", [0.0, 60.0])
def test_hapke_without_absorption_reflects_everything(theta_i):
    # The approximation of H is good to 1 %, and H enters twice.
    total = reflectance("hapke", {"w": 1.0, **SMOOTH}, theta_i, [80.0], [], 12)
    assert total == pytest.approx(1.0, abs=0.02)


def test_hapke_with_little_scattering_is_lommel_and_seeliger():
    value = REFERENCES["hapke"].value({"w": 1e-12, **SMOOTH}, 40.0, 0.0, 25.0, 70.0)
    cosines = np.cos(np.deg2rad([40.0, 25.0]))
    assert float(value) == pytest.approx(1e-12 / (4 * np.pi * cosines.sum()), rel=1e-11)


def test_chandrasekhars_h_at_its_ends():
    assert float(hapke.multiple_scattering(mpf(10) ** -30, mpf("0.9"))) == pytest.approx(1.0, abs=1e-20)
    # Chandrasekhar, Radiative Transfer, Table XI: 2.9078 without absorption; the approximation has 1 %.
    assert float(hapke.multiple_scattering(mpf(1), mpf(1))) == pytest.approx(2.9078, rel=0.01)


def test_hapkes_phase_function_has_mean_one():
    mean = quad(lambda x: hapke.phase_function(x, mpf("0.4"), mpf("0.3")), [-1, 1]) / 2
    assert float(fabs(mean - 1)) < 1e-20
    assert hapke.phase_function(mpf(1), mpf("0.4"), mpf(1)) > hapke.phase_function(
        mpf(-1), mpf("0.4"), mpf(1)
    )


def test_hapkes_roughness_by_hand():
    """All angles 45°, azimuth 90°: every tangent is 1, cosψ is 0 and sin²(ψ/2) is ½."""
    e1, e2, chi, cosine = np.exp(-2 / np.pi), np.exp(-1 / np.pi), (1 + np.pi) ** -0.5, 0.5**0.5
    eta = chi * cosine * (1 + e2 / (2 - e1))
    effective = chi * cosine * (1 + e2 / 2 / (2 - 1.5 * e1))
    f = np.exp(-2.0)
    S = effective / eta * cosine / eta * chi / (1 - f + f * chi * cosine / eta)
    mu_0, mu, shadowing = hapke.Roughness(pi / 4).apply(pi / 4, pi / 4, pi / 2)
    assert [float(mu_0), float(mu), float(shadowing)] == pytest.approx([effective, effective, S], rel=1e-14)


def test_hapkes_opposition_effect_halves_where_the_tangent_is_h():
    rest = {"w": 1e-12, "b": 0.0, "c": 0.5, "theta_bar": 0.0, "h": np.tan(np.deg2rad(10.0))}
    with_it, without = (
        REFERENCES["hapke"].value({**rest, "B0": B0}, 30.0, 0.0, 10.0, 0.0) for B0 in (0.6, 0.0)
    )
    assert float(with_it / without) == pytest.approx(1.3, rel=1e-11)


def test_hapkes_roughness_is_continuous_where_the_zenith_angles_meet():
    for theta_bar in (5.0, 30.0, 45.0):
        parameters = {"w": 0.6, "b": 0.3, "c": 0.4, "theta_bar": theta_bar, "h": 0.1, "B0": 0.5}
        below, above = (
            REFERENCES["hapke"].value(parameters, 50.0, 0.0, 50.0 + d, 75.0) for d in (-1e-12, 1e-12)
        )
        assert float(below) == pytest.approx(float(above), rel=1e-11)
