"""The detector sees a cone of directions and not one.

    f = 1 / (Ω cosθr) ∫_Ω f_r(ωi, ω) cosθ dω,     Ω = 2π (1 − cos(angle / 2))

P_s of (2) is what the whole aperture receives, and Ω its solid angle. Source: equation (2) of Wang, Zhang and
Dong (2013), which gives Ω an uncertainty of 0.7 % and not its size; 1° is a common one.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt
from pydantic import Field, model_validator

from clbrdf.instrument.rules import Rule
from clbrdf.instrument.vectors import mirrored
from clbrdf.storage.tomlfile import TomlTable

Array = npt.NDArray[np.float64]


class Aperture(TomlTable):
    """Settings.

    Attributes
    ----------
    angle : float
        Full angle of the cone that the detector's aperture fills, seen from the sample, degrees; in its place
        a file may give the aperture's `diameter` and its `distance` from the sample, both in mm.
    """

    angle: Annotated[float, Field(gt=0.0, le=40.0)] = 1.0

    @model_validator(mode="before")
    @classmethod
    def _from_lengths(cls, value: Any) -> Any:
        if not isinstance(value, Mapping) or not {"diameter", "distance"} & set(value):
            return value
        rest = {name: setting for name, setting in value.items() if name not in ("diameter", "distance")}
        lengths = [
            v for v in map(value.get, ("diameter", "distance")) if isinstance(v, int | float) and v > 0.0
        ]
        if "angle" in rest or len(lengths) != 2:
            raise ValueError("give angle, or diameter and distance, both in mm and above 0")
        return {**rest, "angle": math.degrees(2.0 * math.atan(lengths[0] / 2.0 / lengths[1]))}


def solid_angle(angle: float) -> float:
    """Ω of a cone of a full angle in degrees, sr: 4π sin²(angle / 4)."""
    return float(4.0 * np.pi * np.sin(np.deg2rad(angle) / 4.0) ** 2)


def aperture_nodes(angle: float | Array, source: Array, view: Array, rule: Rule) -> tuple[Array, Array]:
    """Return view vectors (N, K, 3) and weights (N, K), for vectors (N, 3); the weights hold cosθ / cosθr.

    `angle` is the full angle of the cone, degrees, one or (N,).
    """
    half_angle = np.broadcast_to(np.deg2rad(angle) / 2.0, len(view))
    nodes, shares = rule.nodes(view, mirrored(source), half_angle)
    return nodes, shares * nodes[..., 2] / view[:, None, 2]


def cone_angle(solid: Array) -> Array:
    """Full angle, degrees, of a cone of a solid angle, sr; inverse of `solid_angle`."""
    return np.asarray(np.rad2deg(4.0 * np.arcsin(np.sqrt(np.clip(solid / (4.0 * np.pi), 0.0, 1.0)))))
