"""The objective in NumPy, one thread, parameter sets in blocks that stay in the cache."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from clbrdf.fit.problem import Problem

BLOCK = 32


def numpy_objective(
    problem: Problem, sets: npt.NDArray[np.float64], dtype: type[np.floating]
) -> Callable[[], npt.NDArray[np.floating]]:
    """Return a function that computes E of sets (K, P) in a type."""
    cos_i, log2_v, log2_s = (np.ascontiguousarray(column, dtype=dtype) for column in problem.features.T)
    target, scale = problem.target[0].astype(dtype), problem.scale[0].astype(dtype)
    a, b, c, d, ks, kd = (column.astype(dtype)[:, None] for column in sets.T)
    log2_e, inverse_pi = dtype(np.log2(np.e)), dtype(1.0 / np.pi)
    out = np.empty(len(sets), dtype=dtype)

    def run() -> npt.NDArray[np.floating]:
        for first in range(0, len(sets), BLOCK):
            k = slice(first, first + BLOCK)
            exponent = np.exp2(d[k] * log2_v)
            exponent *= c[k] * log2_e
            exponent += a[k] * log2_e * (b[k] - cos_i) ** 2 + log2_s
            exponent += np.log2(ks[k])
            f = np.exp2(exponent, out=exponent)
            f += kd[k] * inverse_pi
            f *= scale
            f -= target
            out[k] = np.einsum("kn,kn->k", f, f)
        return out

    return run
