"""Standard uncertainties of fitted parameters, and whether the data can tell them apart.

Linearised at the optimum: with J the (N, P) derivatives of the model and g the weights,

    C = s² (JᵀGJ)⁻¹ (JᵀGVGJ) (JᵀGJ)⁻¹,

V the variances of the measured values. Where the scan gives them, V = diag(σ²) and s² = 1; else V is taken
proportional to 1/g and s² = Σ g r² / (N − P), the residual scale. Parameters at a bound are held: they get
NaN and leave the system. Source: Bevington and Robinson, Data Reduction and Error Analysis (3rd ed.,
2003), chapters 8 and 11, in the sandwich form for weights that differ from 1/σ².
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.models import Model

Array = npt.NDArray[np.float64]

SMALLEST_EIGENVALUE = 1e-13
"""Of the system scaled to a unit diagonal: below it, N eps of rounding hides the direction."""

INVOLVED = 1e-3
"""Share of a parameter in a hidden direction from which it counts as undetermined."""


@dataclass(frozen=True)
class Uncertainty:
    """Result for one wavelength.

    Attributes
    ----------
    sigma : (P,) float64
        1σ; NaN at a bound, infinite where the data cannot tell.
    determined : bool
        Whether all parameters off their bounds are determined.
    """

    sigma: Array
    determined: bool


def uncertainty(
    model: Model,
    features: Array,
    parameters: Array,
    at_bound: npt.NDArray[np.bool_],
    measured: Array,
    weights: Array,
    sigma: Array | None,
) -> Uncertainty:
    """Return the uncertainties at one wavelength.

    Parameters
    ----------
    model : Model
    features : (N, F) float64
    parameters : (P,) float64
        At the optimum.
    at_bound : (P,) bool
    measured, weights : (N,) float64
        1/sr and g; values of weight 0 are left out.
    sigma : (N,) float64 or None
        Standard uncertainties of the measured values, 1/sr.
    """
    used = weights > 0.0
    x, g, free = features[used], weights[used] / weights.max(), ~at_bound
    jacobian = model.jacobian(parameters[None, :], x)[:, free]
    out = np.full(len(parameters), np.nan)
    n, p = jacobian.shape
    if p == 0:
        return Uncertainty(out, True)
    root = np.sqrt(g)[:, None] * jacobian
    length = np.sqrt((root**2).sum(axis=0))
    felt = length > 0.0
    unit = np.divide(root, length, out=np.zeros_like(root), where=felt)
    values, vectors = np.linalg.eigh(unit.T @ unit)
    hidden = values < SMALLEST_EIGENVALUE * max(1, n)
    undetermined = (np.abs(vectors[:, hidden]) > INVOLVED).any(axis=1) | ~felt
    inverse = vectors[:, ~hidden] / values[~hidden] @ vectors[:, ~hidden].T
    if sigma is not None and np.isfinite(sigma[used]).all():
        spread = np.sqrt(g)[:, None] * unit * sigma[used][:, None]
        covariance = inverse @ (spread.T @ spread) @ inverse
    elif n > p:
        residual = np.sqrt(g) * (model.brdf(parameters[None, :], x) - measured[used])
        covariance = inverse * (residual @ residual) / (n - p)
    else:
        covariance = np.full_like(inverse, np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        deviation = np.sqrt(np.diag(covariance)) / length
    out[free] = np.where(undetermined, np.inf, deviation)
    return Uncertainty(out, not undetermined.any() and n >= p)
