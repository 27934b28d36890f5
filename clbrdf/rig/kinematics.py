r"""Where the axes stand for a pair of directions, and back: the goniometer of Wang, Zhang and Dong (2013).

The rig
-------
The detector stands still on the +x axis, seen from the sample in the centre; z is up. Three axes:

    lamp α     the cantilever turns about z:          source  s = (cos α, sin α, 0)
    turn β     the sample's stage turns about z
    pitch γ    the sample pitches about the stage's own horizontal axis

    normal                  n  = ( cosγ cosβ,  cosγ sinβ, sinγ)
    horizontal in the face  e1 = (−sinβ,       cosβ,      0   )
    upwards in the face     e2 = (−sinγ cosβ, −sinγ sinβ, cosγ)      (e1, e2, n) right-handed

Forward
-------
Directions seen from the sample, azimuth from e1 towards e2:

    detector d = (1, 0, 0):   d·e1 = −sinβ       d·e2 = −sinγ cosβ        d·n = cosγ cosβ
    source s:                 s·e1 = sin(α−β)    s·e2 = −sinγ cos(α−β)    s·n = cosγ cos(α−β)

    θ = atan2(√(·e1² + ·e2²), ·n)        φ = atan2(·e2, ·e1)

atan2 of both sides keeps full accuracy at every angle.

Inverse
-------
Only φ = φr − φi enters. The angle between source and detector fixes the lamp,

    sin²(α/2) = sin²((θi−θr)/2) + sinθi sinθr sin²(φ/2)
    cos²(α/2) = cos²((θi+θr)/2) + sinθi sinθr cos²(φ/2)

(haversine form, no cancellation), and the normal follows from n·d = cosθr, n·s = cosθi and the triple
product n·(s×d) = sinθi sinθr sinφ, with s×d = (0, 0, −sinα):

    n_x = cosθr
    n_y = (cosθi − cosα cosθr) / sinα = sinθr [sin(θr−θi) + 2 sinθi cosθr sin²(φ/2)] / sinα
    n_z = −sinθi sinθr sinφ / sinα
    β = atan2(n_y, n_x)        γ = atan2(n_z, √(n_x² + n_y²))

Turning everything by 180° about the x axis keeps the detector and maps one solution to another:
(α, β, γ) → (−α, −β, −γ), with the sample turned by 180° in its own plane. There are no more: three axes
set θi, θr and φ; the azimuth φi of the source over the sample's own mark is what results.

α = 0 (source in the line of sight) has no solution; the lamp would stand in front of the detector.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.geometry import Directions, cos_deg, sin_deg, wrap_azimuth

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Pose:
    """Directions as the sample sees them.

    Attributes
    ----------
    theta_i, phi_i, theta_r, phi_r : (N,) float64
        Zeniths [0, 180] and azimuths [0, 360) from the sample's mark e1, degrees. A zenith of 90 or
        more is behind the face.
    """

    theta_i: Array
    phi_i: Array
    theta_r: Array
    phi_r: Array


def forward(axes: Array) -> Pose:
    """Directions for axis angles (N, 3), degrees within [−360, 360], in the order lamp, turn, pitch."""
    lamp, turn, pitch = np.moveaxis(np.asarray(axes, dtype=np.float64), -1, 0)
    theta_i, phi_i = _seen(_half_turn(lamp - turn), pitch)
    # The detector is a source at α = 0.
    theta_r, phi_r = _seen(_half_turn(-turn), pitch)
    return Pose(theta_i, phi_i, theta_r, phi_r)


def _seen(azimuth: Array, pitch: Array) -> tuple[Array, Array]:
    """Zenith and azimuth, from the sample, of a horizontal direction at an azimuth from the stage."""
    pitch = _half_turn(pitch)
    right = sin_deg(azimuth)
    up = -sin_deg(pitch) * cos_deg(azimuth)
    out = cos_deg(pitch) * cos_deg(azimuth)
    theta = np.rad2deg(np.arctan2(np.hypot(right, up), out))
    return theta, wrap_azimuth(np.rad2deg(np.arctan2(up, right)))


def _half_turn(angle: Array) -> Array:
    """Bring an angle to [−180, 180], exactly."""
    return np.asarray(angle - 360.0 * np.round(angle / 360.0))


def inverse(directions: Directions) -> Array:
    """Axis angles (N, 2, 3), degrees, of both solutions; NaN where α = 0.

    The first has α in (0, 180], the second is its mirror (−α, −β, −γ).
    """
    theta_i, theta_r, phi = directions.theta_i, directions.theta_r, directions.phi
    half = np.where(phi > 180.0, phi - 360.0, phi) / 2.0
    sines = sin_deg(theta_i) * sin_deg(theta_r)
    sin2_half = sin_deg((theta_i - theta_r) / 2.0) ** 2 + sines * sin_deg(half) ** 2
    cos2_half = cos_deg((theta_i + theta_r) / 2.0) ** 2 + sines * cos_deg(half) ** 2
    lamp = 2.0 * np.rad2deg(np.arctan2(np.sqrt(sin2_half), np.sqrt(cos2_half)))
    sin_lamp = 2.0 * np.sqrt(sin2_half * cos2_half)
    with np.errstate(divide="ignore", invalid="ignore"):
        normal_y = (
            sin_deg(theta_r)
            * (sin_deg(theta_r - theta_i) + 2.0 * sin_deg(theta_i) * cos_deg(theta_r) * sin_deg(half) ** 2)
            / sin_lamp
        )
        normal_z = -sines * 2.0 * sin_deg(half) * cos_deg(half) / sin_lamp
    normal_x = cos_deg(theta_r)
    turn = np.rad2deg(np.arctan2(normal_y, normal_x))
    pitch = np.rad2deg(np.arctan2(normal_z, np.hypot(normal_x, normal_y)))
    first = np.stack([np.where(sin_lamp > 0.0, lamp, np.nan), turn, pitch], axis=-1)
    return np.stack([first, -first], axis=-2)
