"""The geometry that models share, free of cancellation: what a page sees as `g`.

Angles: h = (θi − θr)/2, m = (θi + θr)/2, p = φ/2 folded to (−90°, 90°]. Each sine and cosine is that of an
angle which is exact before it is rounded (`clbrdf.geometry.trigonometry`), so that what is formed of them
here keeps a relative accuracy of a few units in the last place: at the mirror direction, at the hot spot
and at grazing.

    q      = cos²m sin²h + sinθi sinθr cos²p         = |β − β0|² / 4, β = sinθ (cosφ, sinφ) of view and mirror
    tan²θh = q / (cos²m cos²h)                       θh: zenith of the half vector
    sin²θd = sin²h + sinθi sinθr sin²p               θd: angle between half vector and source
    cos²θd = cos²m + sinθi sinθr cos²p
    sin²γ  = sin²h + sinθi sinθr cos²p               γ: half the angle between view and mirror direction
    cos²γ  = cos²m + sinθi sinθr sin²p

Source of the half-angle coordinates: Rusinkiewicz, Rendering Techniques (1998) 11.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

from clbrdf.models.expression import Expression, Tape, atan2, greatest, named, sqrt

INCIDENT = ("sin_i", "cos_i", "sin_phi_i", "cos_phi_i")
"""Leaves that follow from the incident direction alone."""

VIEW = ("sin_r", "cos_r", "sin_h", "cos_h", "sin_m", "cos_m", "sin_p", "cos_p", "psi")
"""Leaves that the view direction enters; psi is |φ| folded to [0, π], radians."""

ANGLES = (*INCIDENT, *VIEW)


def quantity(formula: Callable[[Geometry], Expression]) -> cached_property[Expression]:
    """Make a property of the geometry that is recorded once, under its own name."""
    name = formula.__name__

    def record(g: Geometry) -> Expression:
        return named(name, formula(g))

    record.__doc__ = formula.__doc__
    return cached_property(record)


class Geometry:
    """Angles of one direction as expressions on a tape.

    Sines and cosines: `sin_i`, `cos_i` of θi; `sin_r`, `cos_r` of θr; `sin_h`, `cos_h`, `sin_m`, `cos_m`,
    `sin_p`, `cos_p` of h, m, p; `sin_phi_i`, `cos_phi_i` of the incident azimuth, for surfaces that need
    it; `psi`, the azimuth between view and source in radians, [0, π].
    """

    def __init__(self, tape: Tape) -> None:
        self.tape = tape

    def __getattr__(self, name: str) -> Expression:
        if name not in ANGLES:
            raise AttributeError(f"the geometry has no {name!r}; its angles are {', '.join(ANGLES)}")
        return self.tape.leaf(name)

    @cached_property
    def pi(self) -> Expression:
        """π."""
        return self.tape.pi

    @quantity
    def cosines(self) -> Expression:
        """cosθi cosθr."""
        return self.cos_i * self.cos_r

    @quantity
    def q(self) -> Expression:
        """|β − β0|² / 4, a quarter of the squared distance from the mirror direction in direction cosines."""
        return (self.cos_m * self.sin_h) ** 2 + self.sin_i * self.sin_r * self.cos_p**2

    @quantity
    def x(self) -> Expression:
        """|β − β0|, 0 in the mirror direction, at most 2."""
        return 2.0 * sqrt(self.q)

    @quantity
    def tan2_h(self) -> Expression:
        """tan²θh of the half vector's zenith."""
        return self.q / (self.cos_m * self.cos_h) ** 2

    @quantity
    def sin2_d(self) -> Expression:
        """sin²θd."""
        return self.sin_h**2 + self.sin_i * self.sin_r * self.sin_p**2

    @quantity
    def cos2_d(self) -> Expression:
        """cos²θd."""
        return self.cos_m**2 + self.sin_i * self.sin_r * self.cos_p**2

    @quantity
    def cos_d(self) -> Expression:
        """cosθd."""
        return sqrt(self.cos2_d)

    @quantity
    def one_minus_cos_d(self) -> Expression:
        """1 − cosθd."""
        return self.sin2_d / (1.0 + self.cos_d)

    @quantity
    def schlick(self) -> Expression:
        """(1 − cosθd)⁵."""
        return self.one_minus_cos_d**5

    @quantity
    def phase(self) -> Expression:
        """Phase angle ξ between source and view direction, radians, [0, π]; never by acos."""
        return 2.0 * atan2(sqrt(self.sin2_d), self.cos_d)

    @quantity
    def cos_phi(self) -> Expression:
        """cosφ; 1 towards the source, −1 forward."""
        return (self.cos_p - self.sin_p) * (self.cos_p + self.sin_p)

    @quantity
    def delta(self) -> Expression:
        """Δ = √(tan²θi + tan²θr − 2 tanθi tanθr cosφ), G of the paper's equation (11)."""
        return self.delta_times_cosines / self.cosines

    @quantity
    def delta_times_cosines(self) -> Expression:
        """Δ cosθi cosθr, finite up to grazing."""
        across = (self.sin_i * self.cos_i) * (self.sin_r * self.cos_r) * self.sin_p**2
        return 2.0 * sqrt((self.sin_h * self.cos_h) ** 2 + across)

    @quantity
    def one_minus_cos_gamma(self) -> Expression:
        """1 − cosγ, exactly 0 in the mirror direction."""
        sines = self.sin_i * self.sin_r
        return (self.sin_h**2 + sines * self.cos_p**2) / (1.0 + sqrt(self.cos_m**2 + sines * self.sin_p**2))

    @cached_property
    def half_vector(self) -> tuple[Expression, Expression, Expression]:
        """(x, y, z) of the half vector times 2 cosθd, x towards azimuth 0 of the sample."""
        along = 2.0 * (self.cos_m * self.sin_h + self.sin_r * self.cos_p**2)
        across = 2.0 * self.sin_r * self.sin_p * self.cos_p
        turned = along * self.cos_phi_i - across * self.sin_phi_i
        return turned, along * self.sin_phi_i + across * self.cos_phi_i, 2.0 * self.cos_m * self.cos_h

    @cached_property
    def incident_slopes(self) -> tuple[Expression, Expression]:
        """tanθi (cosφi, sinφi)."""
        tangent = self.sin_i / self.cos_i
        return tangent * self.cos_phi_i, tangent * self.sin_phi_i

    @cached_property
    def view_slopes(self) -> tuple[Expression, Expression]:
        """tanθr (cosφr, sinφr)."""
        tangent, sin_phi = self.sin_r / self.cos_r, 2.0 * self.sin_p * self.cos_p
        return (
            tangent * (self.cos_phi * self.cos_phi_i - sin_phi * self.sin_phi_i),
            tangent * (sin_phi * self.cos_phi_i + self.cos_phi * self.sin_phi_i),
        )

    @quantity
    def largest_cosine(self) -> Expression:
        """Larger one of cosθi and cosθr."""
        return greatest(self.cos_i, self.cos_r)
