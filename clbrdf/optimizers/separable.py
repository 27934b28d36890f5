"""E with the linear parameters solved inside: a function of the other coordinates alone.

At each set of the others, the linear ones solve min ‖B p − t‖² within their limits (variable projection:
Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973) 413).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.fit.box import box_minimum
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
            raise InputError(f"model {whole.model.name} has no linear parameters that are free to solve for")
        self.free = np.setdiff1d(np.arange(len(whole.lower)), self.linear)
        self.lower, self.upper = whole.lower[self.free], whole.upper[self.free]
        self.places = np.array(whole.coordinates.free)[self.linear]
        ends = whole.coordinates.values(np.stack([whole.lower, whole.upper]))[:, self.places]
        self.limits = np.sort(ends, axis=0)

    def values(self, q: Array) -> Array:
        """E (K,) of nonlinear coordinates (K, Q)."""
        return self.solve(q)[0]

    def solve(self, q: Array) -> tuple[Array, Array]:
        """E (K,) and the linear parameters (K, L) that reach it."""
        with np.errstate(all="ignore"):
            basis, rest = self._basis(q)
            p = box_least_squares(basis, rest, self.limits)
            residual = np.einsum("kln,kl->kn", basis, p) - rest
            return tamed(np.einsum("kn,kn->k", residual, residual)), p

    def complete(self, q: Array) -> Array:
        """All coordinates (P,) of nonlinear ones (Q,), with the linear parameters at their best."""
        rows = [self.whole.model.parameters[j] for j in self.whole.coordinates.free]
        _, p = self.solve(q[None])
        out = np.empty(len(self.whole.lower))
        out[self.free] = q
        for place, value in zip(self.linear, p[0], strict=True):
            out[place] = rows[place].to_coordinate(value)
        return np.clip(out, self.whole.lower, self.whole.upper)

    def _basis(self, q: Array) -> tuple[Array, Array]:
        """(K, L, N): s ∂f/∂p of the linear parameters; (K, N): data without what is given."""
        whole = self.whole
        coordinates = np.tile(whole.lower, (len(q), 1))
        coordinates[:, self.free] = q
        parameters = whole.coordinates.values(coordinates)
        parameters[:, self.places] = 0.0
        given = whole.seen.brdf(parameters[:, None, :]) * whole.scale
        columns = []
        for place in self.places:
            parameters[:, place] = 1.0
            columns.append(whole.scale * whole.seen.brdf(parameters[:, None, :]) - given)
            parameters[:, place] = 0.0
        return np.stack(columns, axis=1), whole.target - given


def box_least_squares(basis: Array, target: Array, limits: Array) -> Array:
    """Return the p (K, L) within limits (2, L) that minimise ‖Σ p_l B_l − t‖² for bases (K, L, N), t (K, N).

    A basis of zeros, or one too large for its square, gets its lower limit.
    """
    H = np.einsum("kln,kmn->klm", basis, basis)
    h = np.einsum("kln,kn->kl", basis, np.broadcast_to(target, (len(basis), basis.shape[2])))
    length = np.sqrt(np.einsum("kll->kl", H))
    usable = np.isfinite(length) & (length > 0.0)
    length = np.where(usable, length, 1.0)
    # Scaled to unit length, so that the normal equations of two columns are as good as they can be.
    R = np.where(usable[:, :, None] & usable[:, None, :], H, 0.0) / (length[:, :, None] * length[:, None, :])
    R[:, np.arange(H.shape[1]), np.arange(H.shape[1])] = 1.0
    h = np.where(usable, h, 0.0) / length
    # About the lower limits, from where every coordinate can only grow.
    origin = limits[0] * length
    b = np.einsum("klm,km->kl", R, np.where(usable, origin, 0.0)) - h
    b = np.where(usable, b, 1.0)
    span = np.where(usable, (limits[1] - limits[0]) * length, 0.0)
    x, _ = box_minimum(R.transpose(1, 2, 0), b.T, np.zeros_like(span.T), span.T)
    p = np.where(usable, (origin + x.T) / length, limits[0])
    return np.asarray(np.clip(p, limits[0], limits[1]))
