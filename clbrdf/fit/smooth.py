"""Parameters that change smoothly with wavelength: neighbours start each other, and a penalty ties them.

The penalised fit minimises, over all wavelengths together,

    Φ = Σ_w E_w / v_w + Σ_w Σ_j (q_j,w+1 − q_j,w)² / (τ² R_j² Δλ_w / 10 nm),   v_w = E⁰_w / (N_w − P),

with E of (13), E⁰ of the fit without penalty, q the coordinates of the fit and R their ranges: a random walk
in wavelength that is expected to move by the share τ of its range in 10 nm. The first sum is near N_w − P
where the data alone decide. Gauss–Newton with damping; the system is banded. Uncertainties are those of Φ at
its minimum: what the neighbours say counts.

Source of the prior: Kitagawa and Gersch, J. Am. Stat. Assoc. 79 (1984) 378.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from clbrdf.fit.normal_equations import normal_equations
from clbrdf.fit.polish import EXACT, polish
from clbrdf.fit.problem import Problem
from clbrdf.fit.slit import band_covariance, banded, slit_equations
from clbrdf.fit.solve import Solution

Array = npt.NDArray[np.float64]

SPACING = 10.0
"""nm over which τ is told."""

MOST_ROUNDS = 8
"""Of neighbours starting each other: a good optimum travels that many wavelengths at least."""

MOST_ITERATIONS = 200
TOLERANCE = 1e-9
"""Stop where a step would lower Φ by less than this, relative. Φ is about the number of values and grows by 1
for one standard deviation: of 10⁵ values this is a hundredth of one."""

LEAST_EIGENVALUE = 1e-12
"""Of blocks scaled to a unit diagonal: below it rounding hides the direction; its variance is at least 1 over
this."""

LEAST_CHANGE = 1e-4
"""Smallest τ: below, parameters are the same at all wavelengths, and the valley too narrow to walk along."""


def start_each_other(problem: Problem, solution: Solution) -> Solution:
    """Polish every wavelength from the ends of its neighbours; keep what is lower, until nothing is."""
    q, energy = solution.coordinates.copy(), solution.objective.copy()
    converged, evaluations = solution.converged.copy(), solution.evaluations.copy()
    rows = np.arange(len(q))
    for _ in range(MOST_ROUNDS):
        starts = np.stack([q[np.maximum(rows - 1, 0)], q[np.minimum(rows + 1, len(q) - 1)]], axis=1)
        ends = polish(problem, starts)
        best = ends.objective.argmin(axis=1)
        lower = ends.objective[rows, best] < energy * (1.0 - 1e-9)
        evaluations += ends.evaluations.sum(axis=1)
        if not lower.any():
            break
        for kept, new in ((q, ends.coordinates), (energy, ends.objective), (converged, ends.converged)):
            kept[lower] = new[rows, best][lower]
    return replace(solution, coordinates=q, objective=energy, converged=converged, evaluations=evaluations)


@dataclass(frozen=True, eq=False)
class Tied:
    """What a penalty makes of uncertainties: in coordinates.

    Attributes
    ----------
    covariance : (W, P, P) float64
        Of the coordinates at each wavelength, from the data and the penalty.
    data : (W, P, P) float64
        Curvature of the data's part of Φ, half of it.
    band : (P + 1, W P) float64
        Curvature of Φ, as SciPy stores bands; more of it behind a slit.
    """

    covariance: Array
    data: Array
    band: Array

    def answer(self, steps: Array) -> Array:
        """Return how far the penalised coordinates move where those of the data alone move by (M, W, P)."""
        from scipy.linalg import solveh_banded

        m, w, p = steps.shape
        pull = np.einsum("wpq,mwq->wpm", self.data, steps).reshape(w * p, m)
        return np.asarray(solveh_banded(self.band, pull, lower=True).reshape(w, p, m).transpose(2, 0, 1))


def smooth(
    problem: Problem, solution: Solution, wavelength: Array, change: float, slit: Array | None = None
) -> tuple[Solution, Tied]:
    """Return the penalised solution, and what the penalty makes of the uncertainties of its coordinates.

    Parameters
    ----------
    problem : Problem
        All wavelengths, W.
    solution : Solution
        Of the fit without penalty.
    wavelength : (W,) float64
        nm.
    change : float
        τ, positive.
    slit : (W, W) float64, optional
        What each wavelength is seen as (`clbrdf.fit.slit`).
    """
    from scipy.linalg import solveh_banded

    w, p = solution.coordinates.shape
    values = np.count_nonzero(problem.scale, axis=1)
    noise = np.maximum(solution.objective, 1e-30) / np.maximum(values - len(problem.free), 1)
    given = np.array([j not in problem.free for j in range(p)])
    span = (problem.upper - problem.lower)[0]
    stiffness = SPACING / (change**2 * np.where(given, 1.0, span) ** 2 * np.diff(wavelength)[:, None])
    stiffness = np.where(given, 0.0, stiffness)  # (W − 1, P)

    def phi(q: Array, energy: Array) -> float:
        return float((energy / noise).sum() + (stiffness * np.diff(q, axis=0) ** 2).sum())

    def equations(q: Array) -> tuple[Array, Array, list[Array]]:
        if slit is not None:
            found = slit_equations(problem, slit, noise, q)
            return found.energy, found.gradient, found.blocks
        energy, h, H = normal_equations(problem, q)
        return energy, h / noise[:, None], [H / noise[:, None, None]]

    q, damping = solution.coordinates.copy(), 1e-3
    energy, h, blocks = equations(q)
    now, converged = phi(q, energy), False
    for _ in range(MOST_ITERATIONS):
        gradient = h + _pull(stiffness, q)
        held = ((q <= problem.lower) & (gradient > 0.0)) | ((q >= problem.upper) & (gradient < 0.0)) | given
        band = _banded(blocks[0], stiffness, held) if slit is None else banded(blocks, stiffness, held)
        # A coordinate that nothing feels, neither data nor neighbours, stays where it is.
        unfelt = band[0] <= 1e-14 * band[0].max()
        band[0] = np.where(unfelt, band[0].max(), band[0] * (1.0 + damping))
        try:
            step = solveh_banded(band, -np.where(held, 0.0, gradient).ravel(), lower=True).reshape(w, p)
        except np.linalg.LinAlgError:  # not positive definite to rounding
            damping *= 10.0
            if damping > 1e12:
                break
            continue
        trial = np.clip(q + np.clip(step, -0.25 * span, 0.25 * span), problem.lower, problem.upper)
        trial_energy, trial_h, trial_blocks = equations(trial)
        trial_phi = phi(trial, trial_energy)
        if damping <= 1.0 and -0.5 * (step * gradient).sum() <= TOLERANCE * now:
            converged = True
            break
        if trial_phi < now:
            q, energy, h, blocks, now = trial, trial_energy, trial_h, trial_blocks, trial_phi
            damping = max(damping / 3.0, 1e-12)
        elif damping > 1e12:
            break
        else:
            damping *= 4.0
    held = (q <= problem.lower) | (q >= problem.upper)
    data = blocks[0]
    band = _banded(data, stiffness, held) if slit is None else banded(blocks, stiffness, held)
    band[0] = np.maximum(band[0], 1e-14 * band[0].max())  # of a coordinate that nothing feels
    covariance = _covariance(data, stiffness, held) if slit is None else band_covariance(band, p)
    tied = Tied(covariance, np.where(held[:, :, None] | held[:, None], 0.0, data), band)
    done = np.full(w, converged) | (energy <= EXACT)
    ends = replace(solution, coordinates=q, objective=energy, converged=done)
    return ends, tied


def _pull(stiffness: Array, q: Array) -> Array:
    """Half the gradient of the penalty, (W, P)."""
    tension = stiffness * np.diff(q, axis=0)
    zero = np.zeros((1, q.shape[1]))
    out: Array = np.concatenate([zero, tension]) - np.concatenate([tension, zero])
    return out


def _blocks(H: Array, stiffness: Array, held: npt.NDArray[np.bool_]) -> tuple[Array, Array]:
    """Blocks of the system on (W, P, P) and beside (W − 1, P) the diagonal; held coordinates stand alone."""
    p = H.shape[1]
    zero = np.zeros((1, p))
    ties = np.concatenate([zero, stiffness]) + np.concatenate([stiffness, zero])
    free = ~held
    diagonal = (H + ties[:, :, None] * np.eye(p)) * (free[:, :, None] & free[:, None, :])
    diagonal += np.eye(p) * held[:, :, None]
    return diagonal, -stiffness * (free[:-1] & free[1:])


def _banded(H: Array, stiffness: Array, held: npt.NDArray[np.bool_]) -> Array:
    """Lower band (P + 1, W P) of the system, as SciPy stores it."""
    diagonal, beside = _blocks(H, stiffness, held)
    w, p = held.shape
    band = np.zeros((p + 1, w * p))
    for below in range(p):
        for j in range(p - below):
            band[below, j::p] = diagonal[:, j + below, j]
    band[p, : (w - 1) * p] = beside.ravel()
    return band


def _covariance(H: Array, stiffness: Array, held: npt.NDArray[np.bool_]) -> Array:
    """Diagonal blocks (W, P, P) of the inverse of the system: Schur complements from both ends."""
    diagonal, beside = _blocks(H, stiffness, held)
    w = len(diagonal)
    forward: Array = diagonal.copy()
    backward: Array = diagonal.copy()
    for k in range(1, w):
        coupling = np.outer(beside[k - 1], beside[k - 1])
        forward[k] = forward[k] - coupling * _inverse(forward[k - 1])
        back = w - 1 - k
        coupling = np.outer(beside[back], beside[back])
        backward[back] = backward[back] - coupling * _inverse(backward[back + 1])
    return _inverse(forward + backward - diagonal)


def _inverse(blocks: Array) -> Array:
    """Inverses (..., P, P) of positive blocks; directions hidden by rounding count as hardly determined."""
    length = np.sqrt(np.maximum(np.diagonal(blocks, axis1=-2, axis2=-1), 1e-290))
    scale = length[..., :, None] * length[..., None, :]
    values, vectors = np.linalg.eigh(blocks / scale)
    values = np.maximum(values, LEAST_EIGENVALUE)
    out: Array = (vectors / values[..., None, :]) @ np.swapaxes(vectors, -1, -2) / scale
    return out
