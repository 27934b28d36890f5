"""The source lights the sample from a cone of directions.

    f = 1 / Ω ∫_Ω f_r(ω, ωr) dω,     Ω = 2π (1 − cos(angle / 2))

for a source of even radiance whose whole beam falls on the sample: P_i of (2) counts all of it, from
wherever it comes. Source: definition of f_r, equations (1) and (2) of Wang, Zhang and Dong (2013). The
paper names no divergence; 0.5° is that of sunlight and of a fair collimator.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
import numpy.typing as npt
from pydantic import Field

from clbrdf.scene.cone import cone_nodes
from clbrdf.scene.effects.aperture import solid_angle
from clbrdf.scene.vectors import mirrored
from clbrdf.storage.tomlfile import Settings

Array = npt.NDArray[np.float64]


class Beam(Settings):
    """Settings.

    Attributes
    ----------
    angle : float
        Full angle of the cone that the source fills, seen from the sample, degrees.
    """

    angle: Annotated[float, Field(gt=0.0, le=40.0)] = 0.5


def beam_nodes(settings: Beam, source: Array, view: Array, order: int) -> tuple[Array, Array]:
    """Return source vectors (N, K, 3) and weights (N, K), for vectors (N, 3)."""
    nodes, weights = cone_nodes(source, mirrored(view), np.deg2rad(settings.angle) / 2.0, order)
    return nodes, weights / solid_angle(settings.angle)
