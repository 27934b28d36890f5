"""The source lights the sample from a cone of directions.

    f = 1 / Ω ∫_Ω f_r(ω, ωr) dω,     Ω = 2π (1 − cos(angle / 2))

for a source of even radiance whose whole beam falls on the sample: P_i of (2) counts all of it, from
wherever it comes. Where light is focussed on a spot and P_i is the irradiance of a fixed area times that
area, what comes in at an angle counts by its cosine, and ω is weighted by cosθ. Source: definition of f_r,
equations (1) and (2) of Wang, Zhang and Dong (2013). The paper names no divergence; 0.5° is that of
sunlight and of a fair collimator.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
import numpy.typing as npt
from pydantic import Field

from clbrdf.instrument.rules import Rule
from clbrdf.instrument.vectors import mirrored
from clbrdf.storage.tomlfile import TomlTable

Array = npt.NDArray[np.float64]


class Beam(TomlTable):
    """Settings.

    Attributes
    ----------
    angle : float
        Full angle of the cone that the source fills, seen from the sample, degrees.
    focussed : bool
        Whether a fixed area takes the light, which then counts by its cosine.
    """

    angle: Annotated[float, Field(gt=0.0, le=40.0)] = 0.5
    focussed: bool = False


def beam_nodes(settings: Beam, source: Array, view: Array, rule: Rule) -> tuple[Array, Array]:
    """Return source vectors (N, K, 3) and weights (N, K), which add up to 1, for vectors (N, 3)."""
    half_angle = np.full(len(source), np.deg2rad(settings.angle) / 2.0)
    nodes, shares = rule.nodes(source, mirrored(view), half_angle)
    if settings.focussed:
        shares = shares * nodes[..., 2]
        shares /= shares.sum(axis=1, keepdims=True)
    return nodes, shares
