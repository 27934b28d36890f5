"""What every optimizer minimises: E of (13) at one wavelength, in the model's coordinates q.

The NumPy twin of the OpenCL objective: fp64, analytic derivatives, everything that does not depend on the
parameters formed once.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
import numpy.typing as npt

from clbrdf.fit.problem import Problem

Array = npt.NDArray[np.float64]

HUGE = 1e100
"""Stands for E where it is larger or not a number, so that no optimizer meets an infinity."""

LN_2 = float(np.log(2.0))


class Values(Protocol):
    """E (13) at one wavelength over the box `lower` ≤ q ≤ `upper`, each (P,), without derivatives."""

    lower: Array
    upper: Array

    def values(self, q: Array) -> Array:
        """E (K,) of coordinates (K, P)."""
        ...


class Objective(Values, Protocol):
    """E with its derivatives."""

    def value_and_gradient(self, q: Array) -> tuple[float, Array]:
        """E and ∂E/∂q (P,) at coordinates (P,)."""
        ...

    def residuals(self, q: Array) -> tuple[Array, Array]:
        """r (N,) with E = Σ r², and ∂r/∂q (N, P), at coordinates (P,)."""
        ...


class Coordinates:
    """From free coordinates q (Q) of a wavelength to all parameters (P), for whole arrays at once."""

    def __init__(self, problem: Problem, wavelength: int = 0) -> None:
        model = problem.model
        self.free = list(problem.free)
        rows = [model.parameters[j] for j in self.free]
        self.on_log = np.flatnonzero([p.scale == "log" for p in rows])
        self.sign = np.array([rows[j].sign for j in self.on_log])
        self.given = model.from_coordinates(problem.lower[wavelength])

    def values(self, q: Array) -> Array:
        """Parameters (..., P) of coordinates (..., Q)."""
        free = np.array(q, dtype=np.float64)
        free[..., self.on_log] = self.sign * np.exp2(free[..., self.on_log])
        if len(self.free) == len(self.given):
            return free
        out = np.broadcast_to(self.given, (*free.shape[:-1], len(self.given))).copy()
        out[..., self.free] = free
        return out

    def slopes(self, parameters: Array) -> Array:
        """dp/dq (Q,) at parameters (P,)."""
        free = parameters[self.free]
        out = np.ones_like(free)
        out[self.on_log] = free[self.on_log] * LN_2
        return out


class NumpyObjective:
    """E in NumPy, fp64, over the coordinates that are free.

    Parameters
    ----------
    problem : Problem
    wavelength : int
        Its place in the problem. Directions that are masked there are left out.
    """

    def __init__(self, problem: Problem, wavelength: int = 0) -> None:
        used = problem.scale[wavelength] > 0.0
        self.model, self.coordinates = problem.model, Coordinates(problem, wavelength)
        self.seen = problem.seen.take(used)
        self.scale, self.target = problem.scale[wavelength][used], problem.target[wavelength][used]
        free = self.coordinates.free
        self.lower, self.upper = problem.lower[wavelength][free], problem.upper[wavelength][free]
        self.linear = [k for k, j in enumerate(free) if j in problem.model.linear]

    def values(self, q: Array) -> Array:
        """E (K,) of coordinates (K, Q)."""
        with np.errstate(all="ignore"):
            residual = self.seen.brdf(self.coordinates.values(q)[:, None, :])
            residual *= self.scale
            residual -= self.target
            return tamed(np.einsum("kn,kn->k", residual, residual))

    def at_parameters(self, parameters: Array) -> float:
        """E at parameters (P,) in the units of the table, exactly these; NaN where they are NaN."""
        with np.errstate(all="ignore"):
            residual = self.seen.brdf(parameters[None, :]) * self.scale - self.target
            return float(residual @ residual)

    def value_and_gradient(self, q: Array) -> tuple[float, Array]:
        """E and ∂E/∂q (Q,); where E is HUGE, the gradient is 0."""
        with np.errstate(all="ignore"):
            p = self.coordinates.values(q)
            f, jacobian = self._value_and_jacobian(p)
            r = f * self.scale - self.target
            E = float(r @ r)
            gradient = ((2.0 * self.scale * r) @ jacobian) * self.coordinates.slopes(p)
        if not (E < HUGE and np.isfinite(gradient).all()):
            return min(E, HUGE) if E == E else HUGE, np.zeros_like(q)
        return E, gradient

    def residuals(self, q: Array) -> tuple[Array, Array]:
        """r (N,) and ∂r/∂q (N, Q); not finite where the model is not."""
        with np.errstate(all="ignore"):
            p = self.coordinates.values(q)
            f, jacobian = self._value_and_jacobian(p)
            jacobian *= self.scale[:, None] * self.coordinates.slopes(p)
            return f * self.scale - self.target, jacobian

    def _value_and_jacobian(self, p: Array) -> tuple[Array, Array]:
        """f (N,) and ∂f/∂p (N, Q) at parameters (P,)."""
        free = self.coordinates.free
        jacobian = self.seen.jacobian(p[None, :])
        if self.model.homogeneous:  # f = Σ p ∂f/∂p over the linear parameters
            places = list(self.model.linear)
            return jacobian[:, places] @ p[places], jacobian[:, free]
        return self.seen.brdf(p[None, :]), jacobian[:, free]


def tamed(values: Array) -> Array:
    """Return values with HUGE for those above it and for those that are no numbers."""
    return np.where(values < HUGE, values, HUGE)
