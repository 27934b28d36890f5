"""The best linear parameters within their limits: the minimum of a small quadratic form within a box.

    q(x) = xᵀ R x + 2 bᵀ x,  low ≤ x ≤ high,  R of unit diagonal

The NumPy twin of `kernels/lib/box.cl`, for many forms at once: rounds of descent along one coordinate after
another find which limits hold, then the free coordinates are solved for together. q never rises.

Source: Björck, Numerical Methods for Least Squares Problems (1996), section 5.2.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

ROUNDS = 10
SOLVES = 2
ROUNDING = 1e-15
PIVOT = 1e-13
"""Smallest square of a pivot; R has a unit diagonal, and below this rounding decides."""


def box_minimum(R: Array, b: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """Return x (L, ...) and q (...) there.

    Parameters
    ----------
    R : (L, L, ...) float64
        Symmetric, of unit diagonal.
    b, low, high : (L, ...) float64
        Limits that hold 0; those of infinite length are none.
    """
    count = len(b)
    shape = np.broadcast_shapes(b.shape[1:], R.shape[2:], low.shape[1:], high.shape[1:])
    x = np.zeros((count, *shape))
    for _ in range(ROUNDS if count > 1 else 1):
        for i in range(count):
            pull = b[i] + sum(R[i, j] * x[j] for j in range(count) if j != i)
            x[i] = np.minimum(np.maximum(-pull, low[i]), high[i])
    value, _ = _value(R, b, x)
    for _ in range(SOLVES if count > 1 else 0):
        y = _free_solution(R, b, x, (x > low) & (x < high))
        y = np.minimum(np.maximum(y, low), high)
        tried, rounding = _value(R, b, y)
        lower = tried + rounding < value
        x, value = np.where(lower, y, x), np.where(lower, tried, value)
    # Where sums have overflowed, x = 0 is what is known.
    sound = (value <= 0.0) & (value > -np.inf)
    return np.where(sound, x, 0.0), np.where(sound, value, 0.0)


def _value(R: Array, b: Array, x: Array) -> tuple[Array, Array]:
    """Return q, and the rounding that may be in it: long steps along nearly equal terms cancel."""
    total, size = np.zeros(x.shape[1:]), np.zeros(x.shape[1:])
    for i in range(len(x)):
        parts = [R[i, j] * x[j] for j in range(len(x))]
        total += x[i] * (2.0 * b[i] + sum(parts))
        size += np.abs(x[i]) * (2.0 * np.abs(b[i]) + sum(np.abs(part) for part in parts))
    return total, size * ROUNDING


def _free_solution(R: Array, b: Array, x: Array, free: npt.NDArray[np.bool_]) -> Array:
    """Solve for the free coordinates with the others where they are: Cholesky, coordinate by coordinate."""
    count, f = len(x), free.astype(np.float64)
    L: dict[tuple[int, int], Array] = {}
    y: list[Array] = []
    for i in range(count):
        right = -b[i] - sum(R[i, j] * x[j] * (1.0 - f[j]) for j in range(count))
        right = np.where(free[i], right, x[i])
        for j in range(i + 1):
            entry = R[i, j] * f[i] * f[j] if i != j else f[i] * R[i, i] + (1.0 - f[i])
            entry = entry - sum((L[i, k] * L[j, k] for k in range(j)), np.zeros(()))
            L[i, j] = np.sqrt(np.maximum(entry, PIVOT)) if i == j else entry / L[j, j]
        y.append((right - sum((L[i, k] * y[k] for k in range(i)), np.zeros(()))) / L[i, i])
    for i in reversed(range(count)):
        later = sum((L[k, i] * y[k] for k in range(i + 1, count)), np.zeros(()))
        y[i] = (y[i] - later) / L[i, i]
    return np.stack(np.broadcast_arrays(*y))
