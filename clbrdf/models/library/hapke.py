"""Hapke's regolith: isotropic multiple scattering, two lobes, opposition surge and macroscopic roughness.

    f = w/(4π) μ0e/(μ0e + μe) / cosθi [P (1 + B) + H(μ0e) H(μe) − 1] S

P is the double Henyey–Greenstein function, B the shadow-hiding surge, H the approximation of 2002 to
Chandrasekhar's function, and μ0e, μe, S follow from the mean slope θ̄. Fix B0 at 0 where no phase angles below
about 10° are measured.

The roughness terms are written for the smaller and the larger zenith in place of incidence and view; what
depends on which is which cancels against the cosine in front.
"""

from clbrdf.models.expression import exp, greatest, log1p, magnitude, named, sqrt, tan, where
from clbrdf.models.page import RECIPROCAL, model, shape


def chandrasekhar(x, w, r0):
    """H(x) = 1 / {1 − w x [r0 + (1 − 2 r0 x)/2 · log(1 + 1/x)]}."""
    return 1.0 / (1.0 - w * x * (r0 + (0.5 - r0 * x) * log1p(1.0 / x)))


def value(g, w, b, c, theta_bar, h, B0):
    """Record the value."""
    slope = greatest(tan(theta_bar * g.pi / 180.0), 1e-12)
    chi = 1.0 / sqrt(1.0 + g.pi * slope**2)
    first = 2.0 / (g.pi * slope)
    second = 1.0 / (g.pi * slope**2)

    def of_zenith(name, smaller):
        """sin, cos, E1, E2 and η of the smaller or the larger zenith."""
        incident = g.sin_h < 0.0 if smaller else g.sin_h > 0.0
        sine = named(f"sin_{name}", where(incident, g.sin_i, g.sin_r))
        cosine = named(f"cos_{name}", where(incident, g.cos_i, g.cos_r))
        cot = named(f"cot_{name}", cosine / greatest(sine, 1e-8))
        E1, E2 = exp(-(first * cot)), exp(-(second * named(f"cot2_{name}", cot**2)))
        return sine, cosine, E1, E2, chi * (cosine + sine * slope * E2 / (2.0 - E1))

    sin_s, cos_s, E1_s, E2_s, eta_s = of_zenith("small", True)
    sin_l, cos_l, E1_l, E2_l, eta_l = of_zenith("large", False)
    half = named("sin2_p", g.sin_p**2)
    N = 2.0 - E1_l - named("turn", g.psi / g.pi) * E1_s
    mu_s = chi * (cos_s + sin_s * slope * (g.cos_phi * E2_l + half * E2_s) / N)
    mu_l = chi * (cos_l + sin_l * slope * (E2_l - half * E2_s) / N)
    F = named("azimuth", exp(-2.0 * magnitude(g.sin_p) / greatest(g.cos_p, 1e-17)))
    shadow = (
        mu_s
        * mu_l
        * chi
        / ((mu_s + mu_l) * eta_s * eta_l * (named("less_azimuth", 1.0 - F) + F * chi * cos_s / eta_s))
    )

    gap = (1.0 - b) ** 2
    back, forth = gap + 4.0 * b * g.sin2_d, gap + 4.0 * b * g.cos2_d
    lobes = (1.0 - b**2) * ((1.0 - c) / (forth * sqrt(forth)) + c / (back * sqrt(back)))
    surge = B0 * h / (h + named("tan_d", sqrt(g.sin2_d) / g.cos_d))
    root = sqrt(1.0 - w)
    r0 = (1.0 - root) / (1.0 + root)
    multiple = chandrasekhar(mu_s, w, r0) * chandrasekhar(mu_l, w, r0) - 1.0
    return w / (4.0 * g.pi) * shadow * (lobes * (1.0 + surge) + multiple)


MODEL = model(
    title="Hapke 2012",
    source="Hapke, Theory of Reflectance and Emittance Spectroscopy (2012), doi:10.1017/CBO9781139025683",
    parameters=[
        shape("w", "1", 0.5, (0.0, 0.9999), "single-scattering albedo"),
        shape("b", "1", 0.3, (0.0, 0.95), "width of the scattering lobes"),
        shape("c", "1", 0.5, (0.0, 1.0), "share of the backward lobe"),
        shape("theta_bar", "deg", 15.0, (0.0, 45.0), "mean slope of the surface"),
        shape("h", "1", 0.1, (0.005, 0.5), "width of the opposition surge"),
        shape("B0", "1", 0.0, (0.0, 1.0), "height of the opposition surge"),
    ],
    value=value,
    kind="whole",
    flags=RECIPROCAL,
)
