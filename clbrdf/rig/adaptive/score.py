"""Information of directions: what the next one would add, and what was reached.

With j the derivatives of the BRDF by the parameters, σ its standard uncertainty and C the parameters'
covariance, one more measurement changes C to C − C j jᵀ C / (σ² + jᵀ C j) (Sherman and Morrison). It lowers
tr(C M), M saying what is asked for, by |M^½ C j|² / (σ² + jᵀ C j) (A-optimal), and ln det C by
ln(1 + jᵀ C j / σ²) (D-optimal).

Sources: V. V. Fedorov, Theory of Optimal Experiments (1972); J. Sherman, W. J. Morrison, Ann. Math. Stat. 21
(1950) 124, doi:10.1214/aoms/1177729893.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

WIDE = 1e6
"""Prior standard deviation of a parameter, in units in which the data's derivatives have length one."""


def covariance(jacobian: Array, sigma: Array) -> Array:
    """Covariance (W, P, P) of parameters from derivatives (W, N, P) and standard uncertainties (W, N).

    Values that are no measurement have an infinite σ. What the data leave open stays wide.
    """
    weighted = jacobian / sigma[..., None]
    information = np.einsum("wnp,wnq->wpq", weighted, weighted)
    return invert(information)


def invert(information: Array) -> Array:
    """Inverse (W, P, P) of an information matrix with a weak prior, scaled to a unit diagonal first."""
    length = np.sqrt(np.einsum("wpp->wp", information))
    length = np.where(length > 0.0, length, 1.0)
    scale = length[:, :, None] * length[:, None, :]
    scaled = information / scale + np.eye(information.shape[-1]) / WIDE**2
    return np.asarray(np.linalg.inv(scaled) / scale)


def parameter_metric(parameters: Array, chosen: list[int]) -> Array:
    """M (W, P, P) of the sum of relative variances of some of the parameters (W, P)."""
    out = np.zeros((*parameters.shape, parameters.shape[-1]))
    for place in chosen:
        out[:, place, place] = 1.0 / np.maximum(parameters[:, place] ** 2, 1e-300)
    return out


def field_metric(jacobian: Array, brdf: Array, weight: Array) -> Array:
    """M (W, P, P) of the mean relative variance of a field: Σ w j jᵀ / Σ w f², weights (N,)."""
    size = np.sum(weight * brdf**2, axis=1)
    inner = np.einsum("n,wnp,wnq->wpq", weight, jacobian, jacobian)
    return np.asarray(inner / np.maximum(size, 1e-300)[:, None, None])


def reached(cov: Array, metric: Array, parts: int = 1) -> Array:
    """Relative standard uncertainty (W,) that C and M amount to; of `parts` parameters the worst.

    For several parameters M is diagonal, and each of its entries stands for one.
    """
    if parts > 1:
        each = np.einsum("wpp,wpp->wp", cov, metric)
        return np.asarray(np.sqrt(each.max(axis=1)))
    return np.asarray(np.sqrt(np.maximum(np.einsum("wpq,wqp->w", cov, metric), 0.0)))


def scores(jacobian: Array, sigma: Array, cov: Array, metric: Array | None) -> Array:
    """Return what each of N directions adds, summed: the relative drop of tr(C M), or that of ln det C."""
    moved = np.einsum("wnp,wpq->wnq", jacobian, cov)
    own = np.einsum("wnp,wnp->wn", moved, jacobian)
    if metric is None:
        return np.asarray(np.log1p(own / sigma**2).sum(axis=0))
    drop = np.einsum("wnp,wpq,wnq->wn", moved, metric, moved) / (sigma**2 + own)
    total = np.einsum("wpq,wqp->w", cov, metric)
    return np.asarray((drop / np.maximum(total, 1e-300)[:, None]).sum(axis=0))


def with_one_more(cov: Array, jacobian: Array, sigma: Array) -> Array:
    """Covariance (W, P, P) after one more direction, with derivatives (W, P) and σ (W,)."""
    moved = np.einsum("wpq,wq->wp", cov, jacobian)
    own = np.einsum("wp,wp->w", moved, jacobian)
    return np.asarray(cov - moved[:, :, None] * moved[:, None, :] / (sigma**2 + own)[:, None, None])
