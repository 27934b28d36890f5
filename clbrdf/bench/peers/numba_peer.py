"""The objective in Numba, parallel and fastmath; skipped where Numba is not installed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.fit.problem import Problem


def numba_objective(
    problem: Problem, sets: npt.NDArray[np.float64], dtype: type[np.floating]
) -> Callable[[], npt.NDArray[np.floating]] | None:
    """Return a function that computes E of sets (K, P) in a type; None without Numba."""
    try:
        import numba
    except ImportError:
        return None
    prange: Any = numba.prange

    def objective(
        p: Any, starts: Any, cos_i: Any, log2_v: Any, log2_s: Any, target: Any, scale: Any, out: Any
    ) -> None:
        log2_e = out.dtype.type(1.4426950408889634)
        for k in prange(len(p)):
            a, b, c, d = p[k, 0] * log2_e, p[k, 1], p[k, 2] * log2_e, p[k, 3]
            log2_ks, diffuse = np.log2(p[k, 4]), p[k, 5] * out.dtype.type(1.0 / np.pi)
            total = out.dtype.type(0.0)
            for g in range(len(starts) - 1):
                away = b - cos_i[starts[g]]
                level = a * away * away + log2_ks
                for n in range(starts[g], starts[g + 1]):
                    f = np.exp2(c * np.exp2(d * log2_v[n]) + (level + log2_s[n])) + diffuse
                    r = f * scale[n] - target[n]
                    total += r * r
            out[k] = total

    columns = [np.ascontiguousarray(column, dtype=dtype) for column in problem.features.T]
    target, scale = problem.target[0].astype(dtype), problem.scale[0].astype(dtype)
    typed, out = sets.astype(dtype), np.empty(len(sets), dtype=dtype)
    compiled = numba.njit(parallel=True, fastmath=True)(objective)

    def run() -> npt.NDArray[np.floating]:
        compiled(typed, problem.starts.astype(np.int64), *columns, target, scale, out)
        return out

    return run
