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
    gram: Array, spread: Array, squares: Array, used: npt.NDArray[np.int64], at_bound: npt.NDArray[np.bool_]
) -> Uncertainty:
    """Return the uncertainties at every wavelength.

    Parameters
    ----------
    gram : (W, P, P) float64
        JᵀGJ at the optimum, in any unit.
    spread : (W, P, P) float64
        JᵀGVGJ in that unit squared; NaN where V is not known.
    squares : (W,) float64
        Σ g r², residuals in 1/sr, in the unit of JᵀGJ.
    used : (W,) int64
        Values that count.
    at_bound : (W, P) bool
    """
    length = np.sqrt(np.diagonal(gram, axis1=1, axis2=2))
    free = ~at_bound & (length > 0.0)
    scale = np.where(free, 1.0 / np.where(length > 0.0, length, 1.0), 0.0)
    n, p = used, free.sum(axis=1)

    # Held parameters stand alone with eigenvalue 1.
    both = free[:, :, None] & free[:, None, :]
    scales = scale[:, :, None] * scale[:, None, :]
    system = np.where(both, gram * scales, 0.0) + np.eye(length.shape[1]) * ~free[:, :, None]
    values, vectors = np.linalg.eigh(system)
    hidden = values < SMALLEST_EIGENVALUE * np.maximum(1, n)[:, None]
    inverse = (
        vectors * np.where(hidden, 0.0, 1.0 / np.where(hidden, 1.0, values))[:, None, :]
    ) @ np.swapaxes(vectors, 1, 2)
    inverse *= both
    felt_in_hidden = ((np.abs(vectors) > INVOLVED) & hidden[:, None, :]).any(axis=2)
    undetermined = ~at_bound & (felt_in_hidden | (length == 0.0))

    left = np.maximum(n - p, 1)
    variance = np.where(n > p, squares / left, np.inf)
    known = np.asarray(np.isfinite(spread).all(axis=(1, 2)))
    with np.errstate(invalid="ignore"):  # 0 · ∞ for held parameters
        given = inverse @ np.where(known[:, None, None], spread * scales, 0.0) @ inverse
        covariance = np.where(known[:, None, None], given, inverse * variance[:, None, None])
    deviation = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    with np.errstate(invalid="ignore", divide="ignore"):
        correlation = covariance / (deviation[:, :, None] * deviation[:, None, :])
    correlation[undetermined[:, :, None] | undetermined[:, None, :]] = np.nan
    sigma_p = np.where(undetermined, np.inf, deviation * scale)
    sigma_p[at_bound] = np.nan
    lone = np.where(free, 0.0, 1.0).sum(axis=1) == length.shape[1]
    condition = np.sqrt(values[:, -1] / np.maximum(values[:, 0], 1e-30))
    condition = np.where(undetermined.any(axis=1), np.inf, np.where(lone, np.nan, condition))
    with np.errstate(invalid="ignore"):  # 0 · ∞ for held parameters, where nothing tells the scatter
        covariance = covariance * scales
    determined = ~undetermined.any(axis=1) & (n >= p)
    return Uncertainty(sigma_p, correlation, condition, undetermined, determined, covariance)


def with_covariance(found: Uncertainty, covariance: Array, held: npt.NDArray[np.bool_]) -> Uncertainty:
    """Return uncertainties with another covariance (W, P, P); `held` (W, P) are at a bound or given."""
    deviation = np.sqrt(np.maximum(np.diagonal(covariance, axis1=1, axis2=2), 0.0))
    sigma = np.where(found.undetermined, np.inf, np.where(held, np.nan, deviation))
    with np.errstate(invalid="ignore", divide="ignore"):
        correlation = covariance / (deviation[:, :, None] * deviation[:, None, :])
    told = ~held & ~found.undetermined
    correlation[~(told[:, :, None] & told[:, None, :])] = np.nan
    return replace(found, sigma=sigma, correlation=correlation, covariance=covariance)
