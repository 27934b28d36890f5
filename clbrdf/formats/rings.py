"""Integrals over the hemisphere of values on rings of zenith, exact for values linear in zenith."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def ring_weights(zenith: Array, cosine: bool = True) -> Array:
    """Return weights (T,) of ∫ v(θ) sinθ cosθ dθ (or sinθ dθ), v linear between zeniths (T,), degrees.

    From the antiderivatives of (a + b θ) times sin 2θ / 2 (or sinθ), so that coarse rings are met as well
    as fine ones.
    """
    t = np.deg2rad(np.asarray(zenith, dtype=np.float64))
    if cosine:
        area, moment = -np.cos(2.0 * t) / 4.0, np.sin(2.0 * t) / 8.0 - t * np.cos(2.0 * t) / 4.0
    else:
        area, moment = -np.cos(t), np.sin(t) - t * np.cos(t)
    width = np.diff(t)
    total, first = np.diff(area), np.diff(moment) - t[:-1] * np.diff(area)
    share = first / width  # of the upper end
    out = np.zeros_like(t)
    out[1:] += share
    out[:-1] += total - share
    return out


def turn_weights(azimuth: Array) -> Array:
    """Return weights (P,) of the mean over a full turn, azimuths (P,) increasing, degrees.

    Half a turn from 0° to 180° stands for both halves. A whole turn may repeat its beginning at its end.
    """
    phi = np.asarray(azimuth, dtype=np.float64)
    if len(phi) == 1:
        return np.ones(1)
    span = phi[-1] - phi[0]
    if span < 350.0 and not span + np.diff(phi).max() >= 359.9:
        gaps = np.diff(phi)
        weights = np.append(gaps, 0.0) + np.append(0.0, gaps)
        return np.asarray(weights / weights.sum())
    gaps = np.append(np.diff(phi), 360.0 - span)
    return np.asarray((gaps + np.roll(gaps, 1)) / 720.0)
