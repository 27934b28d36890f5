"""At grazing angles the lit spot and the field of view become long ellipses, and the detector misses light.

A beam of diameter b lights an ellipse b × b / cosθi, long in the plane of incidence; a detector whose field
has the diameter v sees v × v / cosθr, long in the plane of view, at the angle φ to it. Both have their
middle on the axis. Of an evenly lit spot the detector sees

    share = area(spot ∩ field) / area(spot)

and (2) of Wang, Zhang and Dong (2013), which takes the whole of P_s for seen, gives f · share. An affine
map turns the spot into the unit circle and the field into an ellipse with half axes p ≥ q; then the share
is

    1 (q ≥ 1),   p q (p ≤ 1),   else   2/π [α + p q (π/2 − atan2(p sin α, q cos α))],
    sin²α = q² (p² − 1) / (p² − q²)

Source: plane geometry. The paper gives neither diameter; the defaults are those of a field wider than the
spot.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
import numpy.typing as npt
from pydantic import Field

from clbrdf.geometry import Directions, cos_deg, sin_deg
from clbrdf.storage.tomlfile import TomlTable

Array = npt.NDArray[np.float64]


class Footprint(TomlTable):
    """Settings.

    Attributes
    ----------
    beam : float
        Diameter of the beam, mm.
    field : float
        Diameter of the detector's field at the sample, across the line of sight, mm.
    """

    beam: Annotated[float, Field(gt=0.0)] = 5.0
    field: Annotated[float, Field(gt=0.0)] = 10.0


def seen_share(settings: Footprint, directions: Directions) -> Array:
    """Return the share (N,) of the lit spot that the detector sees, 0 to 1."""
    turn = np.where(directions.phi > 180.0, directions.phi - 360.0, directions.phi)
    cosine, sine = cos_deg(turn), sin_deg(turn)
    ratio = settings.beam / settings.field
    # Quadratic form of the field's ellipse in coordinates where the spot is the unit circle.
    x = ratio / cos_deg(directions.theta_i)
    y = np.full(len(directions), ratio)
    narrow = cos_deg(directions.theta_r)
    along = np.stack([x * cosine * narrow, y * sine * narrow])
    across = np.stack([-x * sine, y * cosine])
    m = along[:, None] * along[None, :] + across[:, None] * across[None, :]
    half_trace = (m[0, 0] + m[1, 1]) / 2.0
    gap = np.hypot((m[0, 0] - m[1, 1]) / 2.0, m[0, 1])
    determinant = (x * y * narrow) ** 2
    steep = half_trace + gap
    q, p = 1.0 / np.sqrt(steep), np.sqrt(steep / determinant)
    return covered_share(p, q)


def covered_share(p: Array, q: Array) -> Array:
    """Share (N,) of the unit circle that an ellipse about its middle with half axes p ≥ q covers."""
    with np.errstate(divide="ignore", invalid="ignore"):
        sine = np.sqrt(np.clip(q**2 * (p**2 - 1.0) / (p**2 - q**2), 0.0, 1.0))
    alpha = np.arcsin(sine)
    reach = np.arctan2(p * sine, q * np.cos(alpha))
    between = 2.0 / np.pi * (alpha + p * q * (np.pi / 2.0 - reach))
    return np.where(q >= 1.0, 1.0, np.where(p <= 1.0, p * q, between))
