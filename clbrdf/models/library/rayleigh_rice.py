"""Rayleigh–Rice: a polished surface scatters by its power spectrum, to first order in its roughness.

    f  = 16π²/λ⁴ cosθi cosθr Q S(x/λ),  S(ν) = A / [1 + (Bν)²]^(C/2),  x = |β − β0|
    Q  = ½ (|pp|² + |ss|² + |ps|² + |sp|²) of the index n + ik

A in µm⁴, B in µm. The mean square roughness is 2πA / ((C − 2) B²) for C > 2; the model holds where
(4πσ cosθi/λ)² ≪ 1.
"""

from clbrdf.models.complex import Complex, root
from clbrdf.models.expression import exp, log1p, named
from clbrdf.models.page import (
    NEEDS_WAVELENGTH,
    RECIPROCAL,
    constant,
    linear,
    log_shape,
    model,
    shape,
    wavelength_in_nm,
)


def polarisation(g, n, k):
    """Q."""
    eps = Complex(n**2 - k**2, 2.0 * n * k)
    less = eps - 1.0
    R_i = root(eps - named("sin2_i", g.sin_i**2))
    R_r = root(eps - named("sin2_r", g.sin_r**2))
    p_i, p_r = eps * g.cos_i + R_i, eps * g.cos_r + R_r
    s_i, s_r = R_i + g.cos_i, R_r + g.cos_r
    sin2_phi = named("sin2_phi", (2.0 * g.sin_p * g.cos_p) ** 2)
    sines = named("sines", g.sin_i * g.sin_r)
    factor = less.square()
    pp = (eps * sines + R_i * R_r * g.cos_phi).square() / (p_i.square() * p_r.square())
    ss = named("cos2_phi", g.cos_phi**2) / (s_i.square() * s_r.square())
    ps = R_i.square() * sin2_phi / (p_i.square() * s_r.square())
    sp = R_r.square() * sin2_phi / (s_i.square() * p_r.square())
    return 0.5 * factor * (pp + ss + ps + sp)


def value(g, A, B, C, n, k, wavelength):
    """Record the value."""
    micrometres = wavelength * 1e-3
    frequency2 = named("x2", 4.0 * g.q) / micrometres**2
    spectrum = A * exp(-0.5 * C * log1p(B**2 * frequency2))
    return 16.0 * g.pi**2 / micrometres**4 * g.cosines * polarisation(g, n, k) * spectrum


MODEL = model(
    title="Rayleigh–Rice scatter with a K-correlation spectrum",
    source="Church and Takacs, Proc. SPIE 645 (1986) 107; Stover (2012), doi:10.1117/3.975276",
    parameters=[
        linear("A", "µm⁴", 1e-5, (1e-14, 1e3), "height of the power spectrum", log_floor=1e-14),
        log_shape("B", "µm", 10.0, (0.01, 1000.0), "2π times the correlation length"),
        shape("C", "1", 3.0, (1.0, 5.0), "steepness of the power spectrum"),
        constant("n", "1", 1.5, (0.05, 8.0), "refractive index, real part"),
        constant("k", "1", 0.0, (0.0, 12.0), "refractive index, imaginary part"),
        wavelength_in_nm(),
    ],
    value=value,
    flags=RECIPROCAL | NEEDS_WAVELENGTH,
)
