"""Values of a fitted model with their standard uncertainty, from the full covariance of the parameters.

u²(f) = j C jᵀ, j the derivatives of the value by the parameters (GUM, 5.2.2). Parameters that are fixed or
at their limit are taken as exact; the uncertainty is infinite where one counts that the data cannot tell.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clbrdf.fit.records import Estimate
from clbrdf.observation import ForwardModel

Array = npt.NDArray[np.float64]

CHUNK_BYTES = 32 << 20
"""Of the derivatives of one chunk of wavelengths."""


def standard_uncertainty(seen: ForwardModel, estimate: Estimate) -> Array:
    """Return 1σ of the fitted values (N, W), 1/sr; NaN where there is no fit."""
    w, p = estimate.vector.shape
    known = np.isfinite(estimate.sigma)
    sigma = np.where(known, estimate.sigma, 0.0)
    correlation = np.where(np.isfinite(estimate.correlation), estimate.correlation, 0.0)
    covariance = correlation * sigma[:, :, None] * sigma[:, None, :]
    lost = np.isinf(estimate.sigma)
    out = np.full((len(seen), w), np.nan)
    size = max(1, CHUNK_BYTES // (8 * p * max(1, len(seen.features))))
    fitted = np.flatnonzero(np.isfinite(estimate.vector).all(axis=1))
    for first in range(0, len(fitted), size):
        rows = fitted[first : first + size]
        jacobian = seen.jacobian(estimate.vector[rows][:, None, :])
        square = np.einsum("wnp,wpq,wnq->wn", jacobian, covariance[rows], jacobian)
        value = np.sqrt(np.maximum(square, 0.0))
        counts = (jacobian != 0.0) & lost[rows][:, None, :]
        out[:, rows] = np.where(counts.any(axis=2), np.inf, value).T
    return out
