"""Directions as unit vectors, and what vector arithmetic makes of them.

Nothing here is rearranged against cancellation: the working precision can lose half of its digits.
"""

from __future__ import annotations

from functools import cached_property, lru_cache

from mpmath import acos, cos, fabs, fmod, mp, mpf, radians, sin, sqrt, tan

Vector = tuple[mpf, mpf, mpf]
Angles = tuple[float, float, float, float]
"""theta_i, phi_i, theta_r, phi_r in degrees."""


def dot(u: Vector, v: Vector) -> mpf:
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


def add(u: Vector, v: Vector) -> Vector:
    return u[0] + v[0], u[1] + v[1], u[2] + v[2]


def norm(u: Vector) -> mpf:
    return sqrt(dot(u, u))


class Geometry:
    """One pair of directions as unit vectors away from the surface; z is its normal, x its azimuth 0."""

    def __init__(self, theta_i: float, phi_i: float, theta_r: float, phi_r: float) -> None:
        self.theta_i, self.phi_i, self.theta_r, self.phi_r = (
            radians(mpf(angle)) for angle in (theta_i, phi_i, theta_r, phi_r)
        )
        self.degrees = mpf(theta_i), mpf(phi_i), mpf(theta_r), mpf(phi_r)
        self.cos_i, self.sin_i = cos(self.theta_i), sin(self.theta_i)
        self.cos_r, self.sin_r = cos(self.theta_r), sin(self.theta_r)
        self.incident: Vector = (self.sin_i * cos(self.phi_i), self.sin_i * sin(self.phi_i), self.cos_i)
        self.reflected: Vector = (self.sin_r * cos(self.phi_r), self.sin_r * sin(self.phi_r), self.cos_r)

    @cached_property
    def phi(self) -> mpf:
        """Azimuth between the two planes in radians, 0 in the source's half-plane, folded to [0, π]."""
        difference = fmod(fabs(self.degrees[3] - self.degrees[1]), 360)
        return radians(min(difference, 360 - difference))

    @cached_property
    def cos_phi(self) -> mpf:
        return cos(self.phi)

    @cached_property
    def sin_phi(self) -> mpf:
        return sin(self.phi)

    @cached_property
    def half(self) -> Vector:
        """Unit vector half-way between the two directions."""
        total = add(self.incident, self.reflected)
        length = norm(total)
        return total[0] / length, total[1] / length, total[2] / length

    @cached_property
    def cos_d(self) -> mpf:
        """Cosine of incidence on a facet whose normal is the half vector; rounding can pass 1."""
        return min(dot(self.incident, self.half), mpf(1))

    @cached_property
    def cos_phase(self) -> mpf:
        """Cosine of the angle between the two directions; rounding can pass 1."""
        return max(min(dot(self.incident, self.reflected), mpf(1)), mpf(-1))

    @cached_property
    def phase(self) -> mpf:
        """Angle between the two directions in radians."""
        return acos(self.cos_phase)

    @cached_property
    def beta(self) -> mpf:
        """|β − β0|, between the projections of the reflected and the mirror direction."""
        mirror = (-self.incident[0], -self.incident[1])
        return sqrt((self.reflected[0] - mirror[0]) ** 2 + (self.reflected[1] - mirror[1]) ** 2)

    @cached_property
    def distance(self) -> mpf:
        """√(tan²θi + tan²θr − 2 tanθi tanθr cosφ); rounding can make the sum negative in its last digit."""
        tan_i, tan_r = tan(self.theta_i), tan(self.theta_r)
        return sqrt(fabs(tan_i**2 + tan_r**2 - 2 * tan_i * tan_r * self.cos_phi))


@lru_cache(maxsize=4096)
def _geometry(angles: Angles, digits: int) -> Geometry:
    del digits  # a part of the key: the same directions in another precision are other numbers
    return Geometry(*angles)


def geometry(angles: Angles) -> Geometry:
    """Form the geometry in the precision that is set, or take it from the last ones formed."""
    return _geometry(angles, mp.dps)
