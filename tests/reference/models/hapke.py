"""Hapke's model with macroscopic roughness, shadow-hiding opposition effect and a two-lobe phase function.

Hapke 2012, doi:10.1017/CBO9781139025683, chapters 6, 8, 9 and 12. theta_bar is in degrees; c, the share of
the backward lobe, is (1 + c)/2 there.
"""

from __future__ import annotations

from mpmath import cos, cot, exp, ln, mpf, pi, radians, sin, sqrt, tan

from tests.reference.models.reference import Reference


def multiple_scattering(x: mpf, w: mpf) -> mpf:
    """Give Hapke's approximation (2002) of Chandrasekhar's H for isotropic scatterers."""
    gamma = sqrt(1 - w)
    r0 = (1 - gamma) / (1 + gamma)
    return 1 / (1 - w * x * (r0 + (1 - 2 * r0 * x) / 2 * ln((1 + x) / x)))


def phase_function(cos_phase: mpf, b: mpf, c: mpf) -> mpf:
    """Give two Henyey-Greenstein lobes; c is the weight of the backward one."""
    backward = (1 - b**2) / (1 - 2 * b * cos_phase + b**2) ** mpf("1.5")
    forward = (1 - b**2) / (1 + 2 * b * cos_phase + b**2) ** mpf("1.5")
    return c * backward + (1 - c) * forward


class Roughness:
    """Effective cosines and the shadowing function of a surface with mean slope theta_bar (radians)."""

    def __init__(self, theta_bar: mpf) -> None:
        self.theta_bar = theta_bar
        self.chi = 1 / sqrt(1 + pi * tan(theta_bar) ** 2)

    def e1(self, y: mpf) -> mpf:
        if not self.theta_bar or not y:
            return mpf(0)
        return exp(-2 / pi * cot(self.theta_bar) * cot(y))

    def e2(self, y: mpf) -> mpf:
        if not self.theta_bar or not y:
            return mpf(0)
        return exp(-1 / pi * cot(self.theta_bar) ** 2 * cot(y) ** 2)

    def eta(self, y: mpf) -> mpf:
        return self.chi * (cos(y) + sin(y) * tan(self.theta_bar) * self.e2(y) / (2 - self.e1(y)))

    def _effective(self, y: mpf, numerator: mpf, denominator: mpf) -> mpf:
        return self.chi * (cos(y) + sin(y) * tan(self.theta_bar) * numerator / denominator)

    def apply(self, i: mpf, e: mpf, psi: mpf) -> tuple[mpf, mpf, mpf]:
        """Give the effective cosines of incidence and emergence, and S."""
        half = sin(psi / 2) ** 2
        if i <= e:
            denominator = 2 - self.e1(e) - psi / pi * self.e1(i)
            mu_0 = self._effective(i, cos(psi) * self.e2(e) + half * self.e2(i), denominator)
            mu = self._effective(e, self.e2(e) - half * self.e2(i), denominator)
            steeper = cos(i) / self.eta(i)
        else:
            denominator = 2 - self.e1(i) - psi / pi * self.e1(e)
            mu_0 = self._effective(i, self.e2(i) - half * self.e2(e), denominator)
            mu = self._effective(e, cos(psi) * self.e2(i) + half * self.e2(e), denominator)
            steeper = cos(e) / self.eta(e)
        f = exp(-2 * tan(psi / 2)) if psi < radians(180) else mpf(0)
        S = mu / self.eta(e) * cos(i) / self.eta(i) * self.chi / (1 - f + f * self.chi * steeper)
        return mu_0, mu, S


def _hapke(g, p, wavelength):
    w = p["w"]
    mu_0, mu, S = Roughness(radians(p["theta_bar"])).apply(g.theta_i, g.theta_r, g.phi)
    opposition = p["B0"] / (1 + tan(g.phase / 2) / p["h"])
    scattered = phase_function(g.cos_phase, p["b"], p["c"]) * (1 + opposition)
    scattered += multiple_scattering(mu_0, w) * multiple_scattering(mu, w) - 1
    return w / (4 * pi) * mu_0 / (mu_0 + mu) * scattered * S / g.cos_i


HAPKE = Reference(
    ("w", "b", "c", "theta_bar", "h", "B0"),
    _hapke,
    edges={"w": (0, 1), "theta_bar": (0, None)},
)
