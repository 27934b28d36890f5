"""E at every wavelength with its gradient and JᵀJ, in NumPy: for fits that tie wavelengths."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clbrdf.fit.problem import Problem

Array = npt.NDArray[np.float64]

CHUNK_BYTES = 32 << 20
"""Of the derivatives of one chunk of wavelengths."""


def normal_equations(problem: Problem, q: Array) -> tuple[Array, Array, Array]:
    """Return E (W,), half its gradient (W, P) and JᵀJ (W, P, P) at coordinates (W, P).

    Masked values have no part in it, whatever the model is there.
    """
    model = problem.model
    w, p = q.shape
    energy, h, H = np.empty(w), np.empty((w, p)), np.empty((w, p, p))
    size = max(1, CHUNK_BYTES // (8 * p * len(problem.seen.features)))
    parameters = model.from_coordinates(q)
    slopes = np.stack([row.slope(parameters[:, j]) for j, row in enumerate(model.parameters)], axis=1)
    for first in range(0, w, size):
        rows = slice(first, first + size)
        s = problem.scale[rows]
        residual = np.where(s > 0.0, s * problem.seen.brdf(parameters[rows, None, :]), 0.0)
        residual -= problem.target[rows]
        jacobian = problem.seen.jacobian(parameters[rows, None, :])
        jacobian *= s[..., None] * slopes[rows, None, :]
        jacobian[s == 0.0] = 0.0
        across = np.swapaxes(jacobian, 1, 2)
        energy[rows], H[rows] = (residual**2).sum(axis=1), across @ jacobian
        h[rows] = (across @ residual[..., None])[..., 0]
    return energy, h, H
