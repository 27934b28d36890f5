"""Error bars where some parameters are one number for all wavelengths.

As `clbrdf.fit.uncertainty`, for the system of all wavelengths. With J the derivatives at a wavelength by its
own parameters, K those by the shared ones, T = (JᵀGJ)⁻¹ JᵀGK and U = K − J T, the shared ones deviate by

    δ = S⁻¹ Σ_w UᵀG ε_w,  S = Σ_w UᵀGU,

and the others at a wavelength by (JᵀGJ)⁻¹ JᵀG ε_w − T δ. Where the scan gives σ, that is the spread of ε;
else it is taken as s_w²/g with s_w² = Σ g r² / (N − P) of each wavelength: one that fits badly says less.

Source: Björck, Numerical Methods for Least Squares Problems (1996), section 6.3.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from clbrdf.fit.shared import inverse_of
from clbrdf.fit.uncertainty import CHUNK_BYTES, SMALLEST_EIGENVALUE, Uncertainty, with_covariance
from clbrdf.observation import ForwardModel

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class SharedSystem:
    """How S shared parameters answer: δ = S⁻¹ Σ_w UᵀG ε_w, and the others −T δ.

    Attributes
    ----------
    places : (S,) int
        Of the shared parameters that are off their bounds.
    follow : (W, P, S) float64
        T.
    inner : (S, S) float64
        S⁻¹, with weights relative to the largest.
    """

    places: npt.NDArray[np.intp]
    follow: Array
    inner: Array


def shared_uncertainty(
    seen: ForwardModel,
    parameters: Array,
    own: Mask,
    shared: npt.NDArray[np.intp],
    residuals: Array,
    weights: Array,
    sigma: Array | None,
) -> tuple[Array, Mask, SharedSystem]:
    """Return the covariance (W, P, P) of the parameters at each wavelength, and which shared ones are open.

    Parameters
    ----------
    seen : ForwardModel
        Of the N directions.
    parameters : (W, P) float64
        At the optimum.
    own : (W, P) bool
        Parameters of one wavelength that are fitted and off their bounds.
    shared : (S,) int
        Places of the shared parameters that are off their bounds.
    residuals, weights : (W, N) float64
        Model less measured value, 1/sr, and g; values of weight 0 are left out.
    sigma : (W, N) float64 or None
        Standard uncertainties of the measured values, 1/sr.

    Returns
    -------
    (W, P, P) float64
        0 in rows and columns of parameters that are neither own nor shared.
    (S,) bool
        Shared parameters that the data cannot tell.
    SharedSystem
    """
    w, p = parameters.shape
    g = weights / weights.max()
    used = weights > 0.0
    known = sigma is not None and np.isfinite(sigma[used]).all()
    count, left = len(shared), used.sum(axis=1) - own.sum(axis=1) - len(shared) / w
    with np.errstate(divide="ignore"):
        level = np.where(left > 0.0, (g * np.where(used, residuals, 0.0) ** 2).sum(axis=1) / left, np.inf)
    inverse, follow = np.empty((w, p, p)), np.empty((w, p, count))
    spread, cross = np.empty((w, p, p)), np.empty((w, p, count))
    system, sandwich, whole = np.zeros((count, count)), np.zeros((count, count)), np.zeros(count)
    size = max(1, CHUNK_BYTES // (8 * p * len(seen.features)))
    for first in range(0, w, size):
        rows = slice(first, first + size)
        jacobian = seen.jacobian(parameters[rows, None, :]) * np.sqrt(g[rows])[..., None]
        jacobian[~used[rows]] = 0.0
        K = jacobian[..., shared]
        J = np.where(own[rows, None, :], jacobian, 0.0)
        inverse[rows] = inverse_of(np.swapaxes(J, 1, 2) @ J, own[rows])
        follow[rows] = inverse[rows] @ (np.swapaxes(J, 1, 2) @ K)
        U = K - J @ follow[rows]
        whole += (K**2).sum(axis=(0, 1))
        if known and sigma is not None:
            variance = g[rows] * np.where(used[rows], sigma[rows], 0.0) ** 2
        else:
            finite = np.where(np.isfinite(level[rows]), level[rows], 0.0)
            variance = np.broadcast_to(finite[:, None], g[rows].shape)
        weighted = np.swapaxes(J * variance[..., None], 1, 2)
        spread[rows], cross[rows] = weighted @ J, weighted @ U
        system += np.einsum("wns,wnt->st", U, U)
        sandwich += np.einsum("wns,wn,wnt->st", U, variance, U)
    length = np.sqrt(np.maximum(np.diagonal(system), 1e-290))
    values, vectors = np.linalg.eigh(system / np.outer(length, length))
    hidden = values < SMALLEST_EIGENVALUE * used.sum()
    inner = (vectors * np.where(hidden, 0.0, 1.0 / np.where(hidden, 1.0, values))) @ vectors.T
    inner /= np.outer(length, length)
    # What is left of K without the part that J can take over may be rounding alone.
    is_open = np.diagonal(system) <= SMALLEST_EIGENVALUE * used.sum() * whole
    is_open |= (np.abs(vectors[:, hidden]) > 1e-3).any(axis=1)
    of_shared = inner @ sandwich @ inner
    covariance = inverse @ spread @ inverse
    covariance += follow @ of_shared @ np.swapaxes(follow, 1, 2)
    mixed = inverse @ cross @ inner @ np.swapaxes(follow, 1, 2)
    covariance -= mixed + np.swapaxes(mixed, 1, 2)
    covariance[:, :, shared] = inverse @ cross @ inner - follow @ of_shared
    covariance[:, shared, :] = np.swapaxes(covariance[:, :, shared], 1, 2)
    covariance[:, shared[:, None], shared] = of_shared
    covariance[~np.isfinite(level) & (not known)] = np.inf
    return covariance, is_open, SharedSystem(shared, follow, inner)


def with_shared(alone: Uncertainty, covariance: Array, is_open: Mask, system: SharedSystem) -> Uncertainty:
    """Return the uncertainties of wavelengths whose shared parameters are not known but fitted.

    Parameters
    ----------
    alone : Uncertainty
        Of the parameters of each wavelength, the shared ones held.
    covariance, is_open, system
        From `shared_uncertainty`.
    """
    undetermined, held = alone.undetermined.copy(), np.isnan(alone.sigma)
    undetermined[:, system.places], held[:, system.places] = is_open, False
    determined = alone.determined & ~is_open.any()
    told = replace(alone, undetermined=undetermined, determined=determined)
    return with_covariance(told, covariance, held)


def common_share(system: SharedSystem, of_shared: Array) -> Array:
    """Return the modes (S, W, P) that a covariance (S, S) of the shared parameters makes."""
    values, vectors = np.linalg.eigh(of_shared)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    modes = -(system.follow @ root)
    modes[:, system.places] = root
    return np.moveaxis(modes, 2, 0)
