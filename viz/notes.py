"""What a picture says in words: what is shown, measured or modelled, on which scale, and what is missing."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clbrdf.viz.directions import angles_of
from clbrdf.viz.lobes import MARGIN
from clbrdf.viz.subject import Subject


def peak_text(values: npt.ArrayLike, vectors: npt.ArrayLike, limit: float | None, signed: bool) -> str:
    """Say the largest value (K,) in 1/sr and its direction, from unit vectors (K, 3)."""
    f = np.asarray(values, dtype=float)
    place = int(np.nanargmax(np.abs(f) if signed else f))
    zenith, azimuth = angles_of(np.asarray(vectors, dtype=float)[place])
    where = f"θr = {zenith:.1f}°" + (f", φ = {azimuth:.0f}°" if zenith > 0.05 else "")
    name = "largest difference" if signed else "peak"
    edge = " (at the edge of the mesh)" if limit is not None and zenith > limit - 0.05 else ""
    return f"{name} {f[place]:.4g} 1/sr at {where}{edge}"


def kind_of(subject: Subject, surface_from_model: bool) -> str:
    """Say where a surface comes from."""
    if surface_from_model and subject.fit is not None:
        return f"model {subject.fit.model.name}, fitted"
    return "measured values, joined by straight lines"


def points_text(subject: Subject, theta_i: float, shown: int, masked: int, drawn: int) -> str:
    """Say how many measured points there are at an incident zenith in degrees, and how many are drawn."""
    if len(subject.rows(theta_i)) == 0:
        angles = subject.scan.incident_angles
        listed = ", ".join(f"{a:g}" for a in angles[:6]) + ("…" if len(angles) > 6 else "")
        return f"not measured at θi = {theta_i:g}° (measured: {listed}°)"
    text = f"{shown} measured point{'s' if shown != 1 else ''}"
    text += f", {drawn} of them drawn" if drawn < shown else ""
    return text + (f", {masked} masked and not shown" if masked else "")


def compared_text(compared: int, asked: int) -> str:
    """Say how many directions of a difference have a value on both sides."""
    return f"{compared} of {asked} directions compared"


def clip_text(limit: float, reach: float) -> str:
    """Say where the mesh ends, and from where on it is extrapolated; view zeniths in degrees."""
    text = f"model drawn to θr = {limit:g}°"
    return text + (f", grey beyond {reach:g}°, where nothing is measured" if limit > reach + MARGIN else "")
