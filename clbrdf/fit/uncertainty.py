"""Standard uncertainties of fitted parameters, and whether the data can tell them apart.

Linearised at the optimum: with J the (N, P) derivatives of the model and g the weights,

    C = s² (JᵀGJ)⁻¹ (JᵀGVGJ) (JᵀGJ)⁻¹,

V the variances of the measured values. Where the scan gives them, V = diag(σ²) and s² = 1; else V is taken
proportional to 1/g and s² = Σ g r² / (N − P), the residual scale. Parameters at a bound are held: they get
NaN and leave the system. Source: Bevington and Robinson, Data Reduction and Error Analysis (3rd ed.,
2003), chapters 8 and 11, in the sandwich form for weights that differ from 1/σ².
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from clbrdf.observation import ForwardModel

Array = npt.NDArray[np.float64]

CHUNK_BYTES = 32 << 20
"""Of the derivatives of one chunk of wavelengths."""

SMALLEST_EIGENVALUE = 1e-13
"""Of the system scaled to a unit diagonal: below it, N eps of rounding hides the direction."""

INVOLVED = 1e-3
"""Share of a parameter in a hidden direction from which it counts as undetermined."""


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Result for W wavelengths and P parameters.

    Attributes
    ----------
    sigma : (W, P) float64
        1σ; NaN at a bound, infinite where the data cannot tell.
    correlation : (W, P, P) float64
        Of the parameters that have a finite σ; NaN for the others.
    condition : (W,) float64
        Condition number of the weighted derivatives √g J of the parameters off their bounds, columns scaled
        to unit length; infinite where the data cannot tell.
    undetermined : (W, P) bool
        Parameters off their bounds that the data cannot tell.
    determined : (W,) bool
        No such parameter, and no fewer values than parameters.
    covariance : (W, P, P) float64
        0 for parameters at a bound; of those that the data cannot tell, what the others leave of it.
    """

    sigma: Array
    correlation: Array
    condition: Array
    undetermined: npt.NDArray[np.bool_]
    determined: npt.NDArray[np.bool_]
    covariance: Array


def uncertainty(
    seen: ForwardModel,
    parameters: Array,
    at_bound: npt.NDArray[np.bool_],
    residuals: Array,
    weights: Array,
    sigma: Array | None,
) -> Uncertainty:
    """Return the uncertainties at every wavelength.

    Parameters
    ----------
    seen : ForwardModel
        Of the N directions.
    parameters : (W, P) float64
        At the optimum.
    at_bound : (W, P) bool
    residuals, weights : (W, N) float64
        Model less measured value, 1/sr, and g; values of weight 0 are left out.
    sigma : (W, N) float64 or None
        Standard uncertainties of the measured values, 1/sr.
    """
    w, p = parameters.shape
    size = max(1, CHUNK_BYTES // (8 * p * len(seen.features)))
    parts = []
    for first in range(0, w, size):
        rows = slice(first, first + size)
        jacobian = seen.jacobian(parameters[rows, None, :])
        s = None if sigma is None else sigma[rows]
        parts.append(_chunk(jacobian, at_bound[rows], residuals[rows], weights[rows], s))
    return Uncertainty(*(np.concatenate(part) for part in zip(*parts, strict=True)))


def _chunk(
    jacobian: Array,
    at_bound: npt.NDArray[np.bool_],
    residuals: Array,
    weights: Array,
    sigma: Array | None,
) -> tuple[Array, Array, Array, npt.NDArray[np.bool_], npt.NDArray[np.bool_], Array]:
    """Fields of an Uncertainty from derivatives (w, N, P)."""
    root = np.sqrt(weights / weights.max(axis=1, keepdims=True))
    jacobian *= root[..., None]
    used = weights > 0.0
    jacobian[~used] = 0.0  # a derivative that is infinite in a masked direction has no part in it
    gram = np.swapaxes(jacobian, 1, 2) @ jacobian
    length = np.sqrt(np.diagonal(gram, axis1=1, axis2=2))
    free = ~at_bound & (length > 0.0)
    scale = np.where(free, 1.0 / np.where(length > 0.0, length, 1.0), 0.0)
    n, p = used.sum(axis=1), free.sum(axis=1)

    # Held parameters stand alone with eigenvalue 1.
    system = gram * scale[:, :, None] * scale[:, None, :] + np.eye(length.shape[1]) * ~free[:, :, None]
    values, vectors = np.linalg.eigh(system)
    hidden = values < SMALLEST_EIGENVALUE * np.maximum(1, n)[:, None]
    inverse = (
        vectors * np.where(hidden, 0.0, 1.0 / np.where(hidden, 1.0, values))[:, None, :]
    ) @ np.swapaxes(vectors, 1, 2)
    inverse *= free[:, :, None] & free[:, None, :]
    felt_in_hidden = ((np.abs(vectors) > INVOLVED) & hidden[:, None, :]).any(axis=2)
    undetermined = ~at_bound & (felt_in_hidden | (length == 0.0))

    if sigma is not None and np.isfinite(sigma[used]).all():
        jacobian *= (root * np.where(used, sigma, 0.0))[..., None]
        spread = (np.swapaxes(jacobian, 1, 2) @ jacobian) * scale[:, :, None] * scale[:, None, :]
        covariance = inverse @ spread @ inverse
    else:
        left = np.maximum(n - p, 1)
        variance = np.where(n > p, (np.where(used, root * residuals, 0.0) ** 2).sum(axis=1) / left, np.inf)
        with np.errstate(invalid="ignore"):  # 0 · ∞ for held parameters
            covariance = inverse * variance[:, None, None]
    deviation = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    with np.errstate(invalid="ignore", divide="ignore"):
        correlation = covariance / (deviation[:, :, None] * deviation[:, None, :])
    correlation[undetermined[:, :, None] | undetermined[:, None, :]] = np.nan
    sigma_p = np.where(undetermined, np.inf, deviation * scale)
    sigma_p[at_bound] = np.nan
    lone = np.where(free, 0.0, 1.0).sum(axis=1) == length.shape[1]
    condition = np.sqrt(values[:, -1] / np.maximum(values[:, 0], 1e-30))
    condition = np.where(undetermined.any(axis=1), np.inf, np.where(lone, np.nan, condition))
    with np.errstate(
        invalid="ignore"
    ):  # 0 · ∞ for held parameters, where nothing is left to tell the scatter
        covariance *= scale[:, :, None] * scale[:, None, :]
    return sigma_p, correlation, condition, undetermined, ~undetermined.any(axis=1) & (n >= p), covariance


def with_covariance(found: Uncertainty, covariance: Array, held: npt.NDArray[np.bool_]) -> Uncertainty:
    """Return uncertainties with another covariance (W, P, P); `held` (W, P) are at a bound or given."""
    deviation = np.sqrt(np.maximum(np.diagonal(covariance, axis1=1, axis2=2), 0.0))
    sigma = np.where(found.undetermined, np.inf, np.where(held, np.nan, deviation))
    with np.errstate(invalid="ignore", divide="ignore"):
        correlation = covariance / (deviation[:, :, None] * deviation[:, None, :])
    told = ~held & ~found.undetermined
    correlation[~(told[:, :, None] & told[:, None, :])] = np.nan
    return replace(found, sigma=sigma, correlation=correlation, covariance=covariance)
