"""How well a model meets a scan: the objective (13), its weights, and the relative deviation (14)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.scan import Scan

Array = npt.NDArray[np.float64]

WEIGHTS = ("none", "relative", "sigma")

BLOCK_VALUES = 1 << 20
"""Values that are worked on at once."""

CACHED = 1 << 15
"""Values that stay in the cache of a core, with what is formed of them."""


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
        Unknown name, σ weights for a scan without uncertainties, weights of the wrong length or sign, or one
        that is infinite.
    """
    usable = ~scan.mask
    out = np.zeros(scan.brdf.shape)
    if isinstance(weights, str):
        if weights == "none":
            out[usable] = 1.0
        elif weights == "relative":
            usable &= scan.brdf > 0.0
            _inverse_squares("a value", scan.brdf, usable, out)
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
            _inverse_squares("an uncertainty", random, usable, out)
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


def unweighted(scan: Scan, weights: Array) -> dict[str, int]:
    """How many values are not masked and have no weight all the same, by reason; those that occur.

    Parameters
    ----------
    weights : (N, W) float64
        From `weight_matrix`.
    """
    without = ~scan.mask & (weights <= 0.0)
    sigma = np.ones(scan.brdf.shape) if scan.sigma is None else scan.sigma
    reasons = {
        "without an uncertainty": np.isnan(sigma),
        "with an uncertainty of 0": sigma == 0.0,
        "at or below 0": scan.brdf <= 0.0,
    }
    counts, left = {}, without
    for reason, holds in reasons.items():
        counts[reason] = int(np.count_nonzero(left & holds))
        left = left & ~holds
    counts["of weight 0"] = int(np.count_nonzero(left))
    return {reason: count for reason, count in counts.items() if count}


def _inverse_squares(what: str, values: Array, where: npt.NDArray[np.bool_], out: Array) -> None:
    """Write 1 / values² into out where asked; raise InputError where one is infinite."""
    for part in _parts(out):
        with np.errstate(
            over="ignore", divide="ignore", invalid="ignore"
        ):  # of values that are not asked for
            squares = values[part] ** -2.0
        np.copyto(out[part], squares, where=where[part])
        endless = np.isinf(out[part])
        if endless.any():
            worst = values[part][endless][0]
            raise InputError(
                f"the weight of {what} of {worst:g} 1/sr is infinite; check the unit of the data"
            )


def residual_scale(scan: Scan, weights: Array) -> Array:
    """Scale s = √(g / Σ g f²), (N, W): with it E is the plain sum of (s (f_model − f))², 0 where masked.

    0 for a wavelength whose values are all 0, too: E has no meaning there.
    """
    measured, scale = np.ascontiguousarray(scan.brdf.T).copy(), np.array(weights.T, order="C")
    scale_residuals(measured, scale)
    return scale.T


def scale_residuals(measured: Array, weights: Array) -> None:
    """Turn measured f (W, N) into s f and weights g into s = √(g / Σ g f²), in place; 0 where masked.

    Formed from weights relative to the largest at each wavelength, so that neither the units of f nor
    those of g can overflow; wavelength by wavelength, whatever the others are.
    """
    w, n = measured.shape
    rows, parts = max(1, CACHED // n), [slice(k, k + CACHED) for k in range(0, n, CACHED)]
    for first in range(0, w, rows):
        f, g = measured[first : first + rows], weights[first : first + rows]
        largest_f, largest_g, total = np.zeros((3, len(f), 1))
        for part in parts:
            f[:, part][~(g[:, part] > 0.0)] = 0.0
            np.maximum(largest_f, np.abs(f[:, part]).max(axis=1, keepdims=True), out=largest_f)
            np.maximum(largest_g, g[:, part].max(axis=1, keepdims=True), out=largest_g)
        empty = (largest_f[:, 0] == 0.0) | (largest_g[:, 0] == 0.0)
        largest_f[empty] = largest_g[empty] = 1.0
        for part in parts:
            unit = f[:, part] / largest_f
            g[:, part] /= largest_g
            total += (g[:, part] * unit * unit).sum(axis=1, keepdims=True)
        norm = np.sqrt(total) * largest_f
        norm[empty] = np.inf
        for part in parts:
            np.sqrt(g[:, part], out=g[:, part])
            g[:, part] /= norm
            f[:, part] *= g[:, part]


def objective(model_values: Array, scan: Scan, weights: Array) -> Array:
    """E of (13), (W,): Σ g (f_model − f)² / Σ g f²; NaN where no value is usable."""
    total = np.full(len(scan.wavelength), np.nan)
    size = max(1, BLOCK_VALUES // len(scan))
    for first in range(0, len(total), size):
        part = slice(first, first + size)
        target, scale = np.array(scan.brdf[:, part].T, order="C"), np.array(weights[:, part].T, order="C")
        scale_residuals(target, scale)
        used = scale > 0.0
        residual = np.where(used, scale * model_values[:, part].T - target, 0.0)
        total[part] = np.where(used.any(axis=1), (residual**2).sum(axis=1), np.nan)
    return total


def relative_rms(model_values: Array, scan: Scan) -> Array:
    """σ_r of (14), (W,): √(mean of ((f_model − f) / f)²); NaN where nothing is left.

    Masked values are left out, and those at or below zero, for which a relative deviation has no meaning.
    """
    total, count = np.zeros((2, len(scan.wavelength)))
    for part in _parts(scan.brdf):
        ratio, usable = _deviations(model_values, scan, part)
        total += (ratio**2).sum(axis=0)
        count += usable.sum(axis=0)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.sqrt(total / count))


def relative_rms_by_incident_angle(model_values: Array, scan: Scan) -> Array:
    """σ_r of (14) for each of `scan.incident_angles` alone, (I, W), as in the paper's Table 2."""
    angles, group = np.unique(scan.theta_i, return_inverse=True)
    total, count = np.zeros((2, len(angles), len(scan.wavelength)))
    for part in _parts(scan.brdf):
        ratio, usable = _deviations(model_values, scan, part)
        np.add.at(total, group[part], ratio**2)
        np.add.at(count, group[part], usable)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.sqrt(total / count))


def _parts(values: Array) -> list[slice]:
    """Parts of the rows of (N, W) whose values stay few."""
    n, w = values.shape
    size = max(1, BLOCK_VALUES // w)
    return [slice(first, first + size) for first in range(0, n, size)]


def _deviations(model_values: Array, scan: Scan, part: slice) -> tuple[Array, npt.NDArray[np.bool_]]:
    """Relative deviations in some directions, 0 where they have no meaning, and where they have one."""
    assert scan.flags is not None
    measured = scan.brdf[part]
    usable = (scan.flags[part] == 0) & (measured > 0.0)
    zero = np.zeros_like(measured)
    return np.divide(model_values[part] - measured, measured, out=zero, where=usable), usable
