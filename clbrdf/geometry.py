"""Directions of incidence and view, and the angles the models need, without cancellation.

θi, θr are zenith angles in [0°, 90°), φ = φr − φi; φ = 180° is the forward half-plane, where the
specular peak lies at θr = θi, and φ = 0° holds the source. γ is the half-angle between the view
direction and the mirror direction of the source (Wang, Zhang and Dong 2013, equation (10)).

Trigonometric functions take degrees and reduce them before they convert to radians: 90° − θ and
θi − θr are exact in floating point where the functions are sensitive, so that results keep a relative
accuracy of a few units in the last place up to grazing angles and into the specular peak.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Directions:
    """N pairs of an incident and a view direction.

    Attributes
    ----------
    theta_i, theta_r : (N,) float64
        Incident and view zenith, degrees, [0, 90).
    phi : (N,) float64
        Azimuth of the view direction from the incident one, φr − φi, degrees, [0, 360).

    Raises
    ------
    InputError
        A zenith outside [0, 90), an angle that is not finite, or shapes that do not broadcast.
    """

    theta_i: Array
    theta_r: Array
    phi: Array

    def __post_init__(self) -> None:
        theta_i, theta_r, phi = broadcast_angles(self.theta_i, self.theta_r, self.phi)
        check_zenith("theta_i", theta_i)
        check_zenith("theta_r", theta_r)
        check_finite("phi", phi)
        for name, values in (("theta_i", theta_i), ("theta_r", theta_r), ("phi", wrap_azimuth(phi))):
            object.__setattr__(self, name, read_only(values))

    def __len__(self) -> int:
        return len(self.theta_i)

    def __getitem__(self, index: slice | npt.NDArray[np.bool_] | npt.NDArray[np.intp]) -> Directions:
        return Directions(self.theta_i[index], self.theta_r[index], self.phi[index])


def broadcast_angles(*angles: npt.ArrayLike) -> list[Array]:
    """Broadcast angles against each other to one dimension, float64.

    Raises
    ------
    InputError
        Shapes that do not broadcast, or more than one dimension.
    """
    try:
        arrays = np.broadcast_arrays(*(np.atleast_1d(np.asarray(a, dtype=np.float64)) for a in angles))
    except ValueError as error:
        shapes = ", ".join(str(np.shape(a)) for a in angles)
        raise InputError(
            f"angles of shapes {shapes} do not belong together; give equal lengths or one value"
        ) from error
    if arrays[0].ndim != 1:
        raise InputError(f"angles have {arrays[0].ndim} dimensions; give one-dimensional arrays")
    return [np.array(a) for a in arrays]


def check_zenith(name: str, values: Array) -> None:
    """Raise InputError, naming the place, where a zenith is not in [0°, 90°)."""
    bad = ~((values >= 0.0) & (values < 90.0))
    if bad.any():
        place = int(np.argmax(bad))
        raise InputError(f"{name}[{place}] is {values[place]:g}°; zenith angles lie in [0°, 90°)")


def check_finite(name: str, values: Array) -> None:
    """Raise InputError, naming the place, where a value is not finite."""
    bad = ~np.isfinite(values)
    if bad.any():
        place = int(np.argmax(bad))
        raise InputError(f"{name}[{place}] is {values[place]:g}; it has to be finite")


def wrap_azimuth(phi: Array) -> Array:
    """Bring an azimuth to [0°, 360°)."""
    wrapped = np.mod(phi, 360.0)
    # np.mod of a tiny negative number rounds up to 360 itself.
    return np.where(wrapped == 360.0, 0.0, wrapped)


def read_only(values: npt.NDArray[np.generic]) -> npt.NDArray[np.generic]:
    """Return the array marked read-only: records at the doors do not change."""
    values.flags.writeable = False
    return values


def sin_deg(angle: npt.ArrayLike) -> Array:
    """Sine of an angle in degrees within [−180, 180], accurate to 2 ulp, also next to ±180°."""
    a = np.asarray(angle, dtype=np.float64)
    folded = np.where(np.abs(a) > 90.0, np.copysign(180.0, a) - a, a)
    # Past 45° the cosine of the (exact) complement is the better conditioned of the two.
    steep = np.abs(folded) > 45.0
    small = np.where(steep, 90.0 - np.abs(folded), folded)
    return np.where(steep, np.copysign(np.cos(np.deg2rad(small)), folded), np.sin(np.deg2rad(small)))


def cos_deg(angle: npt.ArrayLike) -> Array:
    """Cosine of an angle in degrees within [−180, 180], accurate to 2 ulp, also next to ±90°."""
    return sin_deg(90.0 - np.abs(np.asarray(angle, dtype=np.float64)))


def _half_azimuth(phi: Array) -> Array:
    """φ/2 folded to (−90°, 90°], exact in floating point."""
    return np.where(phi > 180.0, phi - 360.0, phi) / 2.0


def sin2_gamma(directions: Directions) -> Array:
    """sin²γ = sin²((θi − θr)/2) + sinθi sinθr cos²(φ/2), shape (N,): no cancellation, from (10)."""
    d = directions
    return (
        sin_deg((d.theta_i - d.theta_r) / 2.0) ** 2
        + sin_deg(d.theta_i) * sin_deg(d.theta_r) * cos_deg(_half_azimuth(d.phi)) ** 2
    )


def cos2_gamma(directions: Directions) -> Array:
    """cos²γ = cos²((θi + θr)/2) + sinθi sinθr sin²(φ/2), shape (N,): no cancellation, from (10)."""
    d = directions
    return (
        cos_deg((d.theta_i + d.theta_r) / 2.0) ** 2
        + sin_deg(d.theta_i) * sin_deg(d.theta_r) * sin_deg(_half_azimuth(d.phi)) ** 2
    )


def one_minus_cos_gamma(directions: Directions) -> Array:
    """Value v = 1 − cosγ = sin²γ / (1 + cosγ), shape (N,), [0, 1]; exactly 0 in the mirror direction."""
    return sin2_gamma(directions) / (1.0 + np.sqrt(cos2_gamma(directions)))


def attenuation_times_cosines(directions: Directions) -> Array:
    """G cosθi cosθr = √(sin²(θi − θr) + 4 sinθi cosθi sinθr cosθr sin²(φ/2)), shape (N,), from (11).

    0 where θi = θr and φ = 0 (retro direction): the model has no specular part there.
    """
    d = directions
    product = (sin_deg(d.theta_i) * cos_deg(d.theta_i)) * (sin_deg(d.theta_r) * cos_deg(d.theta_r))
    return np.sqrt(sin_deg(d.theta_i - d.theta_r) ** 2 + 4.0 * product * sin_deg(_half_azimuth(d.phi)) ** 2)
