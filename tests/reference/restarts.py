"""The best of many restarts of SciPy's bounded least squares, for any model: starts and solver of its own.

Of the package it takes the model alone, its values and derivatives, which other tests hold to the sources.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares, lsq_linear

HUGE = 1e100


class Independent:
    """E of (13) at one wavelength as a function of the parameters that are free.

    Coordinates are log10 for parameters that span decades and are not linear, the parameters themselves else.
    """

    def __init__(self, model, directions, measured, g, bounds, given):
        self.model, self.x = model, model.features(directions)
        norm = np.sqrt(np.sum(g * measured**2))
        self.scale, self.target = np.sqrt(g) / norm, np.sqrt(g) * measured / norm
        self.free = [j for j, name in enumerate(model.names) if name not in given]
        self.fixed = np.array([given.get(name, np.nan) for name in model.names])
        self.rows = [model.parameters[j] for j in self.free]
        self.sign = [row.sign if row.scale == "log" and not row.linear else 0.0 for row in self.rows]
        ends = np.array([[self._inward(k, v) for v in bounds[j]] for k, j in enumerate(self.free)])
        self.low, self.high = np.sort(ends, axis=1).T
        self.linear = [k for k, row in enumerate(self.rows) if row.linear]

    def _inward(self, k, value):
        if not self.sign[k]:
            return value
        return np.log10(max(self.sign[k] * value, self.rows[k].log_floor))

    def parameters(self, q):
        out = self.fixed.copy()
        for k, j in enumerate(self.free):
            out[j] = self.sign[k] * 10.0 ** q[k] if self.sign[k] else q[k]
        return out

    def residuals(self, q):
        with np.errstate(all="ignore"):
            r = self.scale * self.model.brdf(self.parameters(q)[None], self.x) - self.target
        return np.clip(np.nan_to_num(r, nan=HUGE), -HUGE, HUGE)

    def jacobian(self, q):
        p = self.parameters(q)
        slopes = np.array([p[j] * np.log(10.0) if self.sign[k] else 1.0 for k, j in enumerate(self.free)])
        with np.errstate(all="ignore"):
            J = self.model.jacobian(p[None], self.x)[:, self.free] * self.scale[:, None] * slopes
        return np.clip(np.nan_to_num(J), -HUGE, HUGE)

    def start(self, rng):
        """A random point; the linear parameters there by SciPy's bounded linear least squares."""
        q = self.low + (self.high - self.low) * rng.uniform(0.001, 0.999, len(self.low))
        if self.linear:
            columns = self.jacobian(q)[:, self.linear]
            at_zero = q.copy()
            at_zero[self.linear] = 0.0
            limits = self.low[self.linear], self.high[self.linear]
            length = np.linalg.norm(columns, axis=0)
            length = np.where((length > 0.0) & (length < 1e50), length, 1.0)
            end = lsq_linear(
                np.clip(columns / length, -1e50, 1e50),
                -np.clip(self.residuals(at_zero), -1e50, 1e50),
                (limits[0] * length, limits[1] * length),
            )
            q[self.linear] = end.x / length
        return q

    def descend(self, start, evaluations, tolerance):
        span = self.high - self.low
        inside = np.clip(start, self.low + 1e-10 * span, self.high - 1e-10 * span)
        with np.errstate(all="ignore"):
            return least_squares(
                self.residuals,
                inside,
                jac=self.jacobian,
                bounds=(self.low, self.high),
                x_scale="jac",
                max_nfev=evaluations,
                xtol=tolerance,
                ftol=tolerance,
                gtol=tolerance,
            )


def restarts(model, directions, measured, g, bounds, given, count=60, seed=0):
    """Return E at the ends of so many restarts, rising; the lowest few brought to the last digit."""
    problem, rng = Independent(model, directions, measured, g, bounds, given), np.random.default_rng(seed)
    ends = sorted((problem.descend(problem.start(rng), 100, 1e-10) for _ in range(count)), key=_cost)
    fine = [problem.descend(end.x, 1000, 3e-16) for end in ends[:4]]
    return np.sort([2.0 * min(a.cost, b.cost) for a, b in zip(ends, [*fine, *ends[4:]], strict=True)])


def _cost(end):
    return end.cost
