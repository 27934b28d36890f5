"""χ² where the errors of a scan have something in common.

    χ² = rᵀ V⁻¹ r − bᵀ A⁻¹ b,   b = Jᵀ V⁻¹ r,   A = Jᵀ V⁻¹ J

V holds the random part and the modes of the common components, of the model's values. The second term frees
r of what common errors have done to the parameters: weights are those of the random part, so that a panel
that is off has moved `kd`, and that is no misfit. With the total uncertainty in place of V an error that all
values share would hide any misfit smaller than itself.

Source: Aitken, Proc. R. Soc. Edinburgh 55 (1936) 42; the minimum of rᵀ V⁻¹ r over small changes of the
parameters.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clbrdf.fit.gls import PrecisionMatrix
from clbrdf.fit.records import Estimate, Setup
from clbrdf.fit.shared import inverse_of
from clbrdf.fit.uncertainty import CHUNK_BYTES
from clbrdf.observation import ForwardModel
from clbrdf.scan import Scan

Array = npt.NDArray[np.float64]


def has_common_errors(scan: Scan) -> bool:
    """Whether a scan tells random and common errors apart."""
    return bool(scan.common_components) and any(one.is_random for one in scan.components)


def correlated_chi2(seen: ForwardModel, scan: Scan, setup: Setup, estimate: Estimate) -> Array:
    """Return χ² (W,); NaN where there is no fit, or a fitted value has no random uncertainty.

    `seen` is the model as the detector sees it in the scan's directions.
    """
    n, w = scan.brdf.shape
    angles = {name: getattr(scan, name) for name in ("theta_i", "theta_r", "phi_r")}
    columns = sum(one.direction_modes(angles).shape[1] for one in scan.common_components)
    known = np.array([name in setup.fixed for name in seen.model.names])
    random, out = scan.random_sigma, np.full(w, np.nan)
    assert random is not None
    used = setup.weights > 0.0
    told = np.all((random > 0.0) | ~used, axis=0)
    places = setup.fitted[np.asarray(told)[setup.fitted]]
    size = max(1, CHUNK_BYTES // (8 * n * (len(known) + 1 + columns)))
    for first in range(0, len(places), size):
        some = places[first : first + size]
        out[some] = _chi2(seen, scan.columns(some), setup.weights[:, some], estimate, some, known)
    return out


def _chi2(
    seen: ForwardModel,
    scan: Scan,
    weights: Array,
    estimate: Estimate,
    places: npt.NDArray[np.intp],
    known: npt.NDArray[np.bool_],
) -> Array:
    vector, used = estimate.vector[places], weights.T > 0.0
    own = np.isfinite(vector) & ~estimate.at_bound[places] & ~known
    values = seen.brdf(vector[:, None, :])
    residual = np.where(used, values - np.where(used, scan.brdf.T, 0.0), 0.0)
    jacobian = seen.jacobian(vector[:, None, :])
    jacobian = np.where(used[..., None] & own[:, None, :] & np.isfinite(jacobian), jacobian, 0.0)
    both = np.concatenate([jacobian, residual[..., None]], axis=2)
    square = PrecisionMatrix.of(scan, weights, values).across(both, slice(None)) @ both
    b = square[:, :-1, -1:]
    moved = np.swapaxes(b, 1, 2) @ inverse_of(square[:, :-1, :-1], own) @ b
    return np.asarray(square[:, -1, -1] - moved[:, 0, 0])
