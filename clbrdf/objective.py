"""How well a model meets a scan: the objective (13), its weights, and the relative deviation (14)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.scan import Scan

Array = npt.NDArray[np.float64]

WEIGHTS = ("none", "relative", "sigma")


def weight_matrix(scan: Scan, weights: str | npt.ArrayLike = "none") -> Array:
    """Weights g of every value, (N, W), 0 where the scan is masked.

    Parameters
    ----------
    scan : Scan
    weights : "none", "relative", "sigma" or (N,) array
        1 (as in the paper); 1/f² (values at or below zero get 0); 1/σ² of the random part of the scan's
        uncertainties, since what several values have in common says nothing of how they fit together (values
        without one get 0); or one weight a direction, g1(θi) g2(θr) in (13), finite and not negative.

    Raises
    ------
    InputError
        Unknown name, σ weights for a scan without uncertainties, or weights of the wrong length or sign.
    """
    usable = ~scan.mask
    out = np.zeros(scan.brdf.shape)
    if isinstance(weights, str):
        if weights == "none":
            out[usable] = 1.0
        elif weights == "relative":
            usable &= scan.brdf > 0.0
            out[usable] = scan.brdf[usable] ** -2.0
        elif weights == "sigma":
            if scan.sigma is None:
                raise InputError(
                    "weights 'sigma' need the scan's uncertainties, and it has none; use 'relative'"
                )
            random = scan.random_sigma
            if random is None:
                raise InputError(
                    "weights 'sigma' need uncertainties that differ from direction to direction, and all of"
                    " the scan's are common to several; use 'relative'"
                )
            usable &= random > 0.0
            out[usable] = random[usable] ** -2.0
        else:
            raise InputError(f"no weights are called {weights!r}; there are {', '.join(WEIGHTS)}")
        return out
    per_direction = np.asarray(weights, dtype=np.float64)
    if per_direction.shape != (len(scan.theta_i),):
        raise InputError(
            f"weights have shape {per_direction.shape}; give one for each of {len(scan.theta_i)} directions"
        )
    if not (np.isfinite(per_direction).all() and (per_direction >= 0.0).all() and per_direction.any()):
        raise InputError("weights have to be finite, not negative, and not all 0")
    return np.where(usable, per_direction[:, None], 0.0)


def residual_scale(scan: Scan, weights: Array) -> Array:
    """Scale s = √(g / Σ g f²), (N, W): with it E is the plain sum of (s (f_model − f))², 0 where masked.

    0 for a wavelength whose values are all 0, too: E has no meaning there.
    Formed from weights relative to the largest at each wavelength, so that neither the units of f nor
    those of g can overflow.
    """
    measured = np.where(weights > 0.0, scan.brdf, 0.0)
    largest_g = weights.max(axis=0)
    largest_f = np.abs(measured).max(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        g = weights / largest_g
        norm = np.sqrt((g * (measured / largest_f) ** 2).sum(axis=0)) * largest_f
        scale = np.sqrt(g) / norm
    return np.where((weights > 0.0) & (largest_f > 0.0), scale, 0.0)


def objective(model_values: Array, scan: Scan, weights: Array) -> Array:
    """E of (13), (W,): Σ g (f_model − f)² / Σ g f²; NaN where no value is usable."""
    scale = residual_scale(scan, weights)
    residual = np.where(scale > 0.0, scale * (model_values - scan.brdf), 0.0)
    total: Array = (residual**2).sum(axis=0)
    return np.where((scale > 0.0).any(axis=0), total, np.nan)


def relative_rms(model_values: Array, scan: Scan, rows: npt.NDArray[np.bool_] | slice = slice(None)) -> Array:
    """σ_r of (14), (W,): √(mean of ((f_model − f) / f)²) over some rows; NaN where nothing is left.

    Masked values are left out, and those at or below zero, for which a relative deviation has no meaning.
    """
    measured = scan.brdf[rows]
    usable = ~scan.mask[rows] & (measured > 0.0)
    zero = np.zeros_like(measured)
    ratio = np.divide(model_values[rows] - measured, measured, out=zero, where=usable)
    with np.errstate(invalid="ignore"):
        rms: Array = np.sqrt((ratio**2).sum(axis=0) / usable.sum(axis=0))
    return rms


def relative_rms_by_incident_angle(model_values: Array, scan: Scan) -> Array:
    """σ_r of (14) for each of `scan.incident_angles` alone, (I, W), as in the paper's Table 2."""
    angles, group = np.unique(scan.theta_i, return_inverse=True)
    measured = scan.brdf
    usable = ~scan.mask & (measured > 0.0)
    ratio = np.divide(model_values - measured, measured, out=np.zeros_like(measured), where=usable)
    total, count = np.zeros((2, len(angles), measured.shape[1]))
    np.add.at(total, group, ratio**2)
    np.add.at(count, group, usable)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.sqrt(total / count))
