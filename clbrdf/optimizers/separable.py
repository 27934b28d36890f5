"""E with the linear parameters solved inside: a function of the other coordinates alone.

At each set of the others, the linear ones solve min ‖B p − t‖² within their limits. With few of them every
face of their box is tried: free, at the lower limit or at the upper one each (variable projection: Golub and
Pereyra, SIAM J. Numer. Anal. 10 (1973) 413).
"""

from __future__ import annotations

from itertools import product

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.optimizers.objective import NumpyObjective, tamed

Array = npt.NDArray[np.float64]


class SeparableObjective:
    """Lowest E over the linear parameters, as a function of the nonlinear coordinates.

    Parameters
    ----------
    whole : NumpyObjective

    Raises
    ------
    InputError
        The model does not tell its linear parameters (clbrdf.models.structure).
    """

    def __init__(self, whole: NumpyObjective) -> None:
        self.whole = whole
        self.linear = np.array(whole.linear, dtype=np.intp)
        if len(self.linear) == 0:
            raise InputError(f"model {whole.model.name} tells of no linear parameters to solve for")
        self.free = np.setdiff1d(np.arange(len(whole.lower)), self.linear)
        self.lower, self.upper = whole.lower[self.free], whole.upper[self.free]
        ends = whole.coordinates.values(np.stack([whole.lower, whole.upper]))[:, self.linear]
        self.limits = np.sort(ends, axis=0)

    def values(self, q: Array) -> Array:
        """E (K,) of nonlinear coordinates (K, Q)."""
        return self.solve(q)[0]

    def solve(self, q: Array) -> tuple[Array, Array]:
        """E (K,) and the linear parameters (K, L) that reach it."""
        with np.errstate(all="ignore"):
            basis = self._basis(q)
            p = box_least_squares(basis, self.whole.target, self.limits)
            residual = np.einsum("kln,kl->kn", basis, p) - self.whole.target
            return tamed(np.einsum("kn,kn->k", residual, residual)), p

    def complete(self, q: Array) -> Array:
        """All coordinates (P,) of nonlinear ones (Q,), with the linear parameters at their best."""
        model = self.whole.model
        _, p = self.solve(q[None])
        out = np.empty(len(self.whole.lower))
        out[self.free] = q
        for place, value in zip(self.linear, p[0], strict=True):
            out[place] = model.parameters[place].to_coordinate(value)
        return np.clip(out, self.whole.lower, self.whole.upper)

    def _basis(self, q: Array) -> Array:
        """(K, L, N): s f with one linear parameter 1 and the others 0."""
        whole = self.whole
        coordinates = np.zeros((len(q), len(whole.lower)))
        coordinates[:, self.free] = q
        parameters = whole.coordinates.values(coordinates)
        columns = []
        for place in self.linear:
            parameters[:, self.linear] = 0.0
            parameters[:, place] = 1.0
            columns.append(whole.scale * whole.model.brdf(parameters[:, None, :], whole.features))
        return np.stack(columns, axis=1)


def box_least_squares(basis: Array, target: Array, limits: Array) -> Array:
    """Return the p (K, L) within limits (2, L) that minimise ‖Σ p_l B_l − t‖² for bases (K, L, N).

    A basis of zeros, or one too large for its square, gets its lower limit.
    """
    k, n_linear, _ = basis.shape
    H = np.einsum("kln,kmn->klm", basis, basis)
    h = basis @ target
    length = np.sqrt(np.einsum("kll->kl", H))
    usable = np.isfinite(length) & (length > 0.0)
    length = np.where(usable, length, 1.0)
    # Scaled to unit length, so that the normal equations of two columns are as good as they can be.
    H = np.where(usable[:, :, None] & usable[:, None, :], H, 0.0) / (length[:, :, None] * length[:, None, :])
    H[:, np.arange(n_linear), np.arange(n_linear)] = 1.0
    h = np.where(usable, h, -1.0) / length
    low, high = limits[0] * length, limits[1] * length
    best, best_value = np.empty((k, n_linear)), np.full(k, np.inf)
    for face in product("flh", repeat=n_linear):
        p = np.select([np.array(face) == "l", np.array(face) == "h"], [low, high], 0.0)
        free = np.array(face) == "f"
        if free.any():
            system = H[:, free][:, :, free] + 1e-15 * np.eye(int(free.sum()))
            right = h[:, free] - np.einsum("klm,km->kl", H[:, free], p)
            inside = np.linalg.solve(system, right[:, :, None])[:, :, 0]
            p[:, free] = np.clip(inside, low[:, free], high[:, free])
        value = np.einsum("klm,kl,km->k", H, p, p) - 2.0 * np.einsum("kl,kl->k", h, p)
        better = value < best_value
        best[better], best_value[better] = p[better], value[better]
    found = np.isfinite(best_value)
    return np.where(found[:, None], best / length, limits[0])
