"""Directions of incidence and view, and the angles the models need, without cancellation.

θi, θr are zenith angles: θi in [0°, 90°), θr in [0°, 90°) for reflection and in (90°, 180°] for
transmission. φ = φr − φi; φ = 180° is the forward half-plane, where the specular peak lies at θr = θi,
and φ = 0° holds the source. γ is the half-angle between the view direction and the mirror direction of
the source (Wang, Zhang and Dong 2013, equation (10)).

Trigonometric functions take degrees and reduce them before they convert to radians: 90° − θ and
θi − θr are exact in floating point where the functions are sensitive, so that results keep a relative
accuracy of a few units in the last place up to grazing angles and into the specular peak.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError, advice
from clbrdf.records import Record, span_words

Array = npt.NDArray[np.float64]
Real = npt.NDArray[Any]
"""fp64 or fp32."""

ANGLES = ("theta_i", "phi_i", "theta_r", "phi_r")
"""The angles of a pair of directions, in the order in which records and files hold them."""


REFLECTION, TRANSMISSION = "reflection", "transmission"


@dataclass(frozen=True, eq=False)
class Directions(Record):
    """N pairs of an incident and a view direction; immutable.

    Azimuths are counted from a mark on the sample. What depends on φ = φr − φi alone is isotropic; that is a
    property of a model, so that the record keeps both.

    Attributes
    ----------
    theta_i : (N,) float64
        Incident zenith, degrees, [0, 90).
    phi_i : (N,) float64
        Incident azimuth, degrees, [0, 360).
    theta_r : (N,) float64
        View zenith, degrees, [0, 90) for reflection or (90, 180] for transmission.
    phi_r : (N,) float64
        View azimuth, degrees, [0, 360).

    Raises
    ------
    InputError
        A zenith out of range, an angle that is not finite, or shapes that do not broadcast.

    Examples
    --------
    >>> Directions([30.0, 30.0], 90.0, [30.0, 150.0], 270.0).side.tolist()
    ['reflection', 'transmission']
    """

    theta_i: Array
    phi_i: Array
    theta_r: Array
    phi_r: Array

    def __post_init__(self) -> None:
        angles = checked_angles(self.theta_i, self.phi_i, self.theta_r, self.phi_r)
        for name, values in zip(ANGLES, angles, strict=True):
            object.__setattr__(self, name, values)

    @classmethod
    def relative(
        cls,
        theta_i: npt.ArrayLike,
        theta_r: npt.ArrayLike,
        phi: npt.ArrayLike,
        phi_i: npt.ArrayLike = 0.0,
    ) -> Directions:
        """Return directions by φ = φr − φi, degrees; where only that is known or matters, φi is 0."""
        turn, start = (np.asarray(angle, dtype=np.float64) for angle in (phi, phi_i))
        check_finite("phi", np.atleast_1d(turn))
        check_finite("phi_i", np.atleast_1d(start))
        try:
            phi_r = start + turn
        except ValueError as error:
            raise InputError(
                f"phi_i has {start.size} values and phi {turn.size}; give equal numbers, or one of them once"
            ) from error
        return cls(np.asarray(theta_i, np.float64), start, np.asarray(theta_r, np.float64), phi_r)

    @cached_property
    def phi(self) -> Array:
        """φ = φr − φi, (N,), degrees, [0, 360); read-only."""
        phi: Array = wrap_azimuth(self.phi_r - self.phi_i)
        phi.flags.writeable = False
        return phi

    @property
    def turn(self) -> Array:
        """φr − φi, (N,), degrees, folded to (−180, 180]: exact next to 0, where `phi` counts from 360."""
        turn = self.phi_r - self.phi_i
        folded: Array = np.where(turn > 180.0, turn - 360.0, np.where(turn <= -180.0, turn + 360.0, turn))
        return folded

    @property
    def transmitted(self) -> npt.NDArray[np.bool_]:
        """(N,), True where the view direction lies beyond the surface, θr > 90°."""
        return np.greater(self.theta_r, 90.0)

    @property
    def side(self) -> npt.NDArray[np.str_]:
        """(N,), "reflection" where θr < 90°, "transmission" where θr > 90°."""
        return np.where(self.transmitted, TRANSMISSION, REFLECTION)

    def __len__(self) -> int:
        return len(self.theta_i)

    def __repr__(self) -> str:
        if not len(self):
            return "<0 directions>"
        zeniths = f"θi {span_words(self.theta_i, '°')}, θr {span_words(self.theta_r, '°')}"
        return f"<{len(self)} directions: {zeniths}, φ {span_words(self.phi, '°')}>"

    def __getitem__(self, index: slice | npt.NDArray[np.bool_] | npt.NDArray[np.intp]) -> Directions:
        return Directions(*(getattr(self, name)[index] for name in ANGLES))


def checked_angles(
    theta_i: npt.ArrayLike, phi_i: npt.ArrayLike, theta_r: npt.ArrayLike, phi_r: npt.ArrayLike
) -> list[Array]:
    """Return θi, φi, θr, φr (N,) in their ranges, degrees, azimuths wrapped to [0, 360), all read-only.

    Raises
    ------
    InputError
        A zenith out of range, an angle that is not finite, or shapes that do not broadcast.
    """
    angles = broadcast_angles(theta_i, phi_i, theta_r, phi_r)
    check_zenith("theta_i", angles[0])
    check_view_zenith("theta_r", angles[2])
    for name, place in (("phi_i", 1), ("phi_r", 3)):
        check_finite(name, angles[place])
        if not ((angles[place] >= 0.0) & (angles[place] < 360.0)).all():
            angles[place] = wrap_azimuth(angles[place])
    for values in angles:
        values.flags.writeable = False
    return angles


def broadcast_angles(*angles: npt.ArrayLike) -> list[Array]:
    """Broadcast angles against each other to one dimension, float64.

    Raises
    ------
    InputError
        Shapes that do not broadcast, or more than one dimension.
    """
    given = [np.atleast_1d(np.asarray(a, dtype=np.float64)) for a in angles]
    try:
        arrays = np.broadcast_arrays(*given)
    except ValueError as error:
        shapes = ", ".join(str(np.shape(a)) for a in angles)
        raise InputError(
            f"angles of shapes {shapes} do not belong together; give equal lengths or one value"
        ) from error
    if arrays[0].ndim != 1:
        raise InputError(f"angles have {arrays[0].ndim} dimensions; give one-dimensional arrays")
    return [_kept(own, whole) for own, whole in zip(given, arrays, strict=True)]


def _kept(own: Array, whole: Array) -> Array:
    """Return an array that nobody else can write: `own` where it is so already, a copy of `whole` else."""
    return own if own.shape == whole.shape and is_frozen(own) else np.array(whole)


def check_zenith(name: str, values: Array) -> None:
    """Raise InputError, naming the place, where a zenith is not in [0°, 90°)."""
    bad = ~((values >= 0.0) & (values < 90.0))
    if bad.any():
        place = int(np.argmax(bad))
        raise InputError(f"{name}[{place}] is {values[place]:g}°; zenith angles lie in [0°, 90°)")


def check_view_zenith(name: str, values: Array) -> None:
    """Raise InputError, naming the place, where a zenith is neither in [0°, 90°) nor in (90°, 180°]."""
    bad = ~((values >= 0.0) & (values <= 180.0) & (values != 90.0))
    if bad.any():
        place = int(np.argmax(bad))
        raise InputError(
            f"{name}[{place}] is {values[place]:g}°; view zeniths lie in [0°, 90°) for reflection"
            " and in (90°, 180°] for transmission"
        )


def check_reflection(directions: Directions) -> None:
    """Raise InputError where some directions are of transmission: models of reflectance end at 90°."""
    count = int(np.count_nonzero(directions.transmitted))
    if count:
        raise InputError(
            f"{count} of {len(directions)} directions are of transmission (theta_r > 90°);"
            " this model is one of reflection: "
            + advice("leave them out, as Scan.reflection() does", "give zeniths below 90°")
        )


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


def is_frozen(values: npt.NDArray[Any]) -> bool:
    """Return whether nobody can write an array: it owns its memory and is read-only, as is what it views."""
    base: Any = values
    while isinstance(base, np.ndarray):
        if base.flags.writeable:
            return False
        if base.base is None:
            return True
        base = base.base
    return False


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


@dataclass(frozen=True, eq=False)
class Trigonometry:
    """Sines and cosines that the half-angle forms take, each (N,), in fp64 or fp32.

    h = (θi − θr)/2, m = (θi + θr)/2, p = φ/2 folded to (−90°, 90°]. Every one is the sine of an angle that
    is exact before it is rounded to the type, so that each is good to 2 ulp of it.
    """

    sin_i: Real
    cos_i: Real
    sin_r: Real
    cos_r: Real
    sin_h: Real
    cos_h: Real
    cos_m: Real
    sin_p: Real
    cos_p: Real


def trigonometry(directions: Directions, dtype: type[np.floating] = np.float64) -> Trigonometry:
    """Return the sines and cosines of N directions of reflection, computed in a type.

    Raises
    ------
    InputError
        A direction of transmission.
    """
    check_reflection(directions)
    theta_i, theta_r = directions.theta_i, directions.theta_r

    def sine(degrees: Array) -> Real:
        return np.sin(np.deg2rad(degrees).astype(dtype))

    h = (theta_i - theta_r) / 2.0
    p = directions.turn / 2.0
    return Trigonometry(
        sin_i=sine(theta_i),
        cos_i=sine(90.0 - theta_i),
        sin_r=sine(theta_r),
        cos_r=sine(90.0 - theta_r),
        sin_h=sine(h),
        cos_h=sine(90.0 - np.abs(h)),
        cos_m=sine(90.0 - (theta_i + theta_r) / 2.0),
        sin_p=sine(p),
        cos_p=sine(90.0 - np.abs(p)),
    )


def mirror_distance(directions: Directions) -> Array:
    """Return a quarter of |β − β0|², (N,), [0, 1]: 0 in the mirror direction, β the direction cosines."""
    m = np.deg2rad(directions.theta_i + directions.theta_r) / 2.0
    h = np.deg2rad(directions.theta_i - directions.theta_r) / 2.0
    sines = np.sin(np.deg2rad(directions.theta_i)) * np.sin(np.deg2rad(directions.theta_r))
    out: Array = (np.cos(m) * np.sin(h)) ** 2 + sines * np.cos(np.deg2rad(directions.turn) / 2.0) ** 2
    return out


def sin2_gamma(t: Trigonometry) -> Real:
    """sin²γ = sin²((θi − θr)/2) + sinθi sinθr cos²(φ/2), shape (N,): no cancellation, from (10)."""
    out: Real = t.sin_h**2 + t.sin_i * t.sin_r * t.cos_p**2
    return out


def cos2_gamma(t: Trigonometry) -> Real:
    """cos²γ = cos²((θi + θr)/2) + sinθi sinθr sin²(φ/2), shape (N,): no cancellation, from (10)."""
    out: Real = t.cos_m**2 + t.sin_i * t.sin_r * t.sin_p**2
    return out


def one_minus_cos_gamma(t: Trigonometry) -> Real:
    """Value v = 1 − cosγ = sin²γ / (1 + cosγ), shape (N,), [0, 1]; exactly 0 in the mirror direction."""
    one = t.sin_i.dtype.type(1.0)
    out: Real = sin2_gamma(t) / (one + np.sqrt(cos2_gamma(t)))
    return out


def attenuation_times_cosines(t: Trigonometry) -> Real:
    """G cosθi cosθr = 2 √(sin²h cos²h + sinθi cosθi sinθr cosθr sin²(φ/2)), shape (N,), from (11).

    With h = (θi − θr)/2. 0 where θi = θr and φ = 0 (retro direction): the model has no specular part
    there.
    """
    product = (t.sin_i * t.cos_i) * (t.sin_r * t.cos_r)
    half: Real = np.sqrt((t.sin_h * t.cos_h) ** 2 + product * t.sin_p**2)
    return half + half
