"""Generalised least squares: the correlations of the errors count as weights, too.

Minimise rᵀ V⁻¹ r at each wavelength, V = diag(σ²) + U Uᵀ with the modes U of the components that several
values have in common, all of the model's values at the usual optimum. This assumes that the model is exact:
where it is, data and model together measure the common errors (a Fresnel law calibrates the panel), and error
bars shrink; where it is not, its misfit is taken for a common error, and the parameters follow. Correlations
between wavelengths do not count as weights; they do in the covariance.

Source: Aitken, Proc. R. Soc. Edinburgh 55 (1936) 42; Woodbury's identity for V⁻¹.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.fit.solve import Solution
from clbrdf.observation import ForwardModel
from clbrdf.scan import Scan
from clbrdf.scan.component import root_sum

Array = npt.NDArray[np.float64]

MOST_ITERATIONS = 200
TOLERANCE = 1e-14
"""Stop where a step would lower rᵀV⁻¹r by less than this, relative."""

ASSUMES = (
    "generalised least squares takes the model for exact: common errors are estimated from how the data miss"
    " it, and a misfit of the model counts as a common error"
)


@dataclass(frozen=True, eq=False)
class PrecisionMatrix:
    """V⁻¹ at W wavelengths of N directions.

    Attributes
    ----------
    weights : (W, N) float64
        1/σ² of the random part; 0 for values that are left out.
    modes : (W, N, M) float64
        U.
    """

    weights: Array
    modes: Array

    @classmethod
    def of(cls, scan: Scan, weights: Array, values: Array) -> PrecisionMatrix:
        """Return V⁻¹ for model values (W, N) of a scan; values of weight 0 (N, W) are left out.

        Raises
        ------
        InputError
            No common components, or no random part for every value that is fitted.
        """
        common, used = scan.common_components, weights.T > 0.0
        random = [one for one in scan.components if one.is_random]
        if not common or not random:
            raise InputError(
                "generalised least squares needs uncertainties with a random and a common part; the scan has"
                f" {'no random' if common else 'no common'} one"
            )
        sigma = root_sum(random, values.T).T
        if not (sigma[used] > 0.0).all():
            raise InputError(
                "generalised least squares needs a random uncertainty of every value that is fitted"
            )
        angles = {name: getattr(scan, name) for name in ("theta_i", "theta_r", "phi_r")}
        modes = [one.absolute(values.T).T[:, :, None] * one.direction_modes(angles)[None] for one in common]
        inverse = np.where(used, 1.0 / np.where(used, sigma, 1.0) ** 2, 0.0)
        return cls(inverse, np.concatenate(modes, axis=2))

    def across(self, jacobian: Array, rows: slice) -> Array:
        """Return Jᵀ V⁻¹ (w, P, N) of derivatives or residuals (w, N, P) at some wavelengths."""
        g, U = self.weights[rows], self.modes[rows]
        weighted = np.swapaxes(jacobian * g[..., None], 1, 2)
        scaled = U * g[..., None]
        inner = np.eye(U.shape[2]) + np.swapaxes(U, 1, 2) @ scaled
        return np.asarray(weighted - weighted @ U @ np.linalg.solve(inner, np.swapaxes(scaled, 1, 2)))


def generalised(
    seen: ForwardModel, scan: Scan, weights: Array, solution: Solution, lower: Array, upper: Array
) -> tuple[Solution, Array]:
    """Return the optimum of rᵀ V⁻¹ r, and the values (W, N) of the usual one, which V is made of.

    Parameters
    ----------
    seen : ForwardModel
        Of the N directions.
    scan : Scan
        At the W wavelengths of the solution.
    weights : (N, W) float64
    solution : Solution
        The usual optimum, from which damped Gauss–Newton walks.
    lower, upper : (W, P) float64
        Limits of the coordinates.

    Raises
    ------
    InputError
        As `PrecisionMatrix.of`.
    """
    usual = seen.brdf(seen.model.from_coordinates(solution.coordinates)[:, None, :])
    precision = PrecisionMatrix.of(scan, weights, usual)
    q, converged = solution.coordinates.copy(), np.zeros(len(solution.coordinates), dtype=np.bool_)
    for k in range(len(q)):
        q[k], converged[k] = _descend(seen, scan, precision, k, q[k], lower[k], upper[k])
    return replace(solution, coordinates=q, converged=converged & solution.converged), usual


def _descend(
    seen: ForwardModel, scan: Scan, precision: PrecisionMatrix, k: int, q: Array, lower: Array, upper: Array
) -> tuple[Array, bool]:
    model, row, used = seen.model, slice(k, k + 1), precision.weights[k] > 0.0
    measured = np.where(used, scan.brdf[:, k], 0.0)

    def at(point: Array) -> tuple[float, Array, Array]:
        p = model.from_coordinates(point)
        residual = np.where(used, seen.brdf(p[None, :]) - measured, 0.0)
        slopes = np.array([parameter.slope(p[j]) for j, parameter in enumerate(model.parameters)])
        jacobian = np.where(used[:, None], seen.jacobian(p[None, :]) * slopes, 0.0)
        both = precision.across(np.concatenate([jacobian, residual[:, None]], axis=1)[None], row)[0]
        return float(both[-1] @ residual), both[:-1] @ residual, both[:-1] @ jacobian

    damping, (now, h, H) = 1e-3, at(q)
    for _ in range(MOST_ITERATIONS):
        held = ((q <= lower) & (h > 0.0)) | ((q >= upper) & (h < 0.0)) | (lower == upper)
        free = np.flatnonzero(~held & (np.diagonal(H) > 0.0))
        length = np.sqrt(np.diagonal(H)[free])
        system = H[np.ix_(free, free)] / np.outer(length, length) + damping * np.eye(len(free))
        step = np.zeros(len(q))
        step[free] = -np.linalg.solve(system, h[free] / length) / length
        if damping <= 1.0 and -(step @ h) <= TOLERANCE * now:
            return q, True
        trial = np.clip(q + step, lower, upper)
        told = at(trial)
        if told[0] < now:
            q, (now, h, H), damping = trial, told, max(damping / 5.0, 1e-14)
        elif damping > 1e12:
            return q, True
        else:
            damping *= 4.0
    return q, False
