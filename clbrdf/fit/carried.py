"""Parts of the parameters' covariance: each component of the scan's uncertainty, carried to the parameters.

The fit answers errors ε of the values by δp = M ε, M = (JᵀGJ)⁻¹ JᵀG, with J the derivatives and G the
weights at the optimum. An error that several values have in common goes through as a whole: a component with
the modes e = u a (u its standard uncertainty, a a column of a factor of its correlation over directions)
makes s = M e of the parameters, and s sᵀ of their covariance; noise makes M diag(u²) Mᵀ. Relative
uncertainties are taken of the model's values: of measured ones, which carry noise themselves, they would make
low values count too much (Peelle's puzzle).

Source: JCGM 102:2011, 6.2; for weights that are not the inverse of the covariance, White, Econometrica 48
(1980) 817, doi:10.2307/1912934; D'Agostini, Nucl. Instrum. Methods A 346 (1994) 306,
doi:10.1016/0168-9002(94)90719-6, on the puzzle.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.fit.gls import PrecisionMatrix
from clbrdf.fit.shared import inverse_of
from clbrdf.fit.shared_uncertainty import SharedSystem
from clbrdf.fit.uncertainty import CHUNK_BYTES
from clbrdf.geometry import Directions
from clbrdf.observation import ForwardModel
from clbrdf.records import Record
from clbrdf.scan import Component
from clbrdf.scan.correlation import covariance_factor

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

MOST_JOINT = 1500
"""Wavelengths × parameters whose covariances with each other are looked at all at once.

Errors that are random over directions but not over wavelengths have as many modes as there are directions;
above, they count at each wavelength and not between them. Many directions average them out.
"""

MOST_BYTES = 512 << 20
"""Of the answers of all parameters at all wavelengths to each value."""

MOST_MODES = 64
"""Above, the modes of a component are joined to as few as say the same."""

NEGLIGIBLE = 1e-9
"""Share of the largest eigenvalue, parameters scaled to a unit variance, below which a mode says nothing."""


@dataclass(frozen=True, eq=False)
class Part(Record):
    """What one component makes of the covariance of the parameters at W wavelengths.

    Attributes
    ----------
    name : str
        The component's.
    words : str
        What its errors have in common.
    own : (W, P, P) float64
        Covariance of what is independent from wavelength to wavelength.
    modes : (M, W, P) float64
        Errors that wavelengths have in common: Σ_m s_m(λ) s_m(λ′)ᵀ is their covariance between any two.
    is_common : bool
        Whether directions have its errors in common; else it is random over them.

    All NaN at wavelengths that were not fitted.
    """

    name: str
    words: str
    own: Array
    modes: Array
    is_common: bool

    @property
    def covariance(self) -> Array:
        """(W, P, P) at each wavelength."""
        return np.asarray(self.own + np.einsum("mwp,mwq->wpq", self.modes, self.modes))

    def mean_variance(self, weights: Array, place: int) -> float:
        """Variance of Σ_λ weight(λ) p(λ), for weights (W,) and the parameter at a place."""
        used = weights != 0.0
        w = weights[used]
        alone = float(np.sum(w**2 * self.own[used, place, place]))
        return alone + float(np.sum((self.modes[:, used, place] @ w) ** 2))


def carried(
    seen: ForwardModel,
    directions: Directions,
    wavelength: Array,
    components: Sequence[Component],
    parameters: Array,
    own: Mask,
    values: Array,
    weights: Array,
    shared: SharedSystem | None = None,
    precision: PrecisionMatrix | None = None,
) -> tuple[Part, ...]:
    """Return what each component makes of the parameters' covariance.

    Parameters
    ----------
    seen : ForwardModel
        Of the N directions.
    directions : Directions
    wavelength : (W,) float64
        nm.
    components : sequence of Component
        Of N × W values.
    parameters : (W, P) float64
        At the optimum.
    own : (W, P) bool
        Parameters of one wavelength that are fitted and off their bounds.
    values, weights : (W, N) float64
        Of the model, 1/sr, and g; values of weight 0 are left out.
    shared : SharedSystem, optional
        How parameters that are one number for all wavelengths answer.
    precision : PrecisionMatrix, optional
        In place of the weights, where the fit was one of generalised least squares.
    """
    works = [_Work.of(one, directions, wavelength, parameters.shape, shared) for one in components]
    w, p = parameters.shape
    used = weights > 0.0
    # The same factor for all wavelengths: shared parameters weigh them against each other.
    root = np.sqrt(weights / (weights.max() if shared else weights.max(axis=1, keepdims=True)))
    size = max(1, CHUNK_BYTES // (8 * p * len(seen.features)))
    for first in range(0, w, size):
        rows = slice(first, first + size)
        jacobian = seen.jacobian(parameters[rows, None, :]) * root[rows, :, None]
        jacobian[~used[rows]] = 0.0  # a derivative that is infinite in a masked direction has no part in it
        J = np.where(own[rows, None, :], jacobian, 0.0)
        across = np.swapaxes(J, 1, 2)
        if precision is None:
            answer = inverse_of(across @ J, own[rows]) @ (across * root[rows, None, :])  # M, (w, P, N)
        else:
            J = J / np.where(used[rows], root[rows], 1.0)[..., None]
            weighed = precision.across(J, rows)
            answer = inverse_of(weighed @ J, own[rows]) @ weighed
        joint = None
        if shared is not None:
            U = jacobian[..., shared.places] - J @ shared.follow[rows]
            joint = shared.inner @ (np.swapaxes(U, 1, 2) * root[rows, None, :])  # (w, S, N)
        for work in works:
            work.take(rows, answer, joint, values[rows], used[rows])
    return tuple(work.part(shared) for work in works)


@dataclass(eq=False)
class _Work:
    """One component on its way through the wavelengths.

    Attributes
    ----------
    over_directions : (N, K) float64 or None
        Factor of the correlation over directions; None where it is random.
    over_wavelengths : (W, L) float64 or None
        The same over wavelengths.
    answers : (W, P, K) or (W, P, N) float64
        Of the parameters to each mode over directions, at each wavelength for itself.
    joint : (W, S, …) float64
        The same of the shared parameters.
    spread : (W, P, P), cross : (W, P, S), of_shared : (W, S, S)
        Covariances where the answers themselves are not kept.
    """

    component: Component
    over_directions: Array | None
    over_wavelengths: Array | None
    answers: Array | None
    joint: Array | None
    spread: Array
    cross: Array
    of_shared: Array

    @classmethod
    def of(
        cls,
        component: Component,
        directions: Directions,
        wavelength: Array,
        shape: tuple[int, ...],
        shared: SharedSystem | None,
    ) -> _Work:
        (w, p), n = shape, len(directions)
        count = 0 if shared is None else len(shared.places)
        over_directions = None
        if not component.is_random:
            angles = {name: getattr(directions, name) for name in ("theta_i", "theta_r", "phi_r")}
            over_directions = component.direction_modes(angles)
        over_wavelengths = None
        if component.wavelength.form != "random":
            over_wavelengths = component.wavelength.modes(wavelength)
        kept = n if over_directions is None else over_directions.shape[1]
        # Noise, and what would need too much memory, is summed on the way.
        noise = over_directions is None and over_wavelengths is None
        if noise or w * p * kept * 8 > MOST_BYTES or (over_directions is None and w * p > MOST_JOINT):
            kept = 0
        return cls(
            component,
            over_directions,
            over_wavelengths,
            np.zeros((w, p, kept)) if kept else None,
            np.zeros((w, count, kept)) if kept else None,
            np.zeros((w, p, p)),
            np.zeros((w, p, count)),
            np.zeros((w, count, count)),
        )

    def take(self, rows: slice, answer: Array, joint: Array | None, values: Array, used: Mask) -> None:
        """Take in some wavelengths: answers of own (w, P, N) and shared (w, S, N) parameters."""
        u = np.asarray(self.component.values).T[rows]
        if self.component.relative:
            u = u * np.abs(values)
        u = np.where(used, u, 0.0)[:, None, :]
        s = answer * u if self.over_directions is None else (answer * u) @ self.over_directions
        d = None
        if joint is not None:
            d = joint * u if self.over_directions is None else (joint * u) @ self.over_directions
        if self.answers is not None and self.joint is not None:
            self.answers[rows] = s
            if d is not None:
                self.joint[rows] = d
            return
        self.spread[rows] = s @ np.swapaxes(s, 1, 2)
        if d is not None:
            self.cross[rows] = s @ np.swapaxes(d, 1, 2)
            self.of_shared[rows] = d @ np.swapaxes(d, 1, 2)

    def part(self, shared: SharedSystem | None) -> Part:
        """Return the part, when all wavelengths are in."""
        w, p = self.spread.shape[:2]
        if self.answers is None or self.joint is None:
            own, modes = self._summed(shared)
        elif self.over_wavelengths is None and shared is None:
            own, modes = self.answers @ np.swapaxes(self.answers, 1, 2), np.zeros((0, w, p))
        else:
            over = np.eye(w) if self.over_wavelengths is None else self.over_wavelengths
            own, modes = np.zeros((w, p, p)), np.empty((0, w, p))
            for column in over.T:
                more = column[:, None, None] * self.answers
                if shared is not None:
                    together = np.einsum("w,wsk->sk", column, self.joint)
                    more = more - shared.follow @ together
                    more[:, shared.places] = together
                modes = np.concatenate([modes, np.moveaxis(more, 2, 0)])
                if len(modes) > max(MOST_MODES, w * p):
                    modes = fewer(modes)
            if len(modes) > MOST_MODES:
                modes = fewer(modes)
        return Part(self.component.name, self.component.words(), own, modes, not self.component.is_random)

    def _summed(self, shared: SharedSystem | None) -> tuple[Array, Array]:
        """Covariances of errors that are independent from wavelength to wavelength, or taken to be so."""
        w, p = self.spread.shape[:2]
        if shared is None:
            return self.spread, np.zeros((0, w, p))
        # Of the errors of a wavelength d moves the shared parameters, and B d the others there; what is left
        # of those is independent of all that others feel.
        free = np.ones(self.of_shared.shape[:2], dtype=np.bool_)
        follows = self.cross @ inverse_of(self.of_shared, free)
        own = self.spread - follows @ np.swapaxes(self.cross, 1, 2)
        modes = np.empty((0, w, p))
        for k in range(w):
            root = covariance_factor(self.of_shared[k])
            more = -(shared.follow @ root)
            more[k] += follows[k] @ root
            more[:, shared.places] = root
            modes = np.concatenate([modes, np.moveaxis(more, 2, 0)])
            if len(modes) > max(MOST_MODES, w * p):
                modes = fewer(modes)
        return own, fewer(modes)


def fewer(modes: Array) -> Array:
    """Return as few modes (M′, W, P) as make the same covariance as modes (M, W, P)."""
    m, w, p = modes.shape
    flat = modes.reshape(m, w * p)
    length = np.sqrt((flat**2).sum(axis=0))
    scaled = flat / np.where(length > 0.0, length, 1.0)
    if m <= w * p:
        values, vectors = np.linalg.eigh(scaled @ scaled.T)
        kept = values > NEGLIGIBLE * values[-1]
        return np.asarray((vectors[:, kept].T @ scaled) * length).reshape(-1, w, p)
    values, vectors = np.linalg.eigh(scaled.T @ scaled)
    kept = values > NEGLIGIBLE * values[-1]
    return np.asarray((vectors[:, kept] * np.sqrt(values[kept])).T * length).reshape(-1, w, p)


def total(parts: Sequence[Part]) -> Array:
    """Return the covariance (W, P, P) of all parts together."""
    return np.asarray(np.sum([part.covariance for part in parts], axis=0))


@dataclass(frozen=True, eq=False)
class Mean:
    """The mean of a parameter over wavelengths.

    Attributes
    ----------
    value, sigma : float
        In the parameter's unit; 1σ with the covariances between wavelengths.
    parts : mapping of str to float
        1σ of it by component; the squares add up to that of `sigma`.
    count : int
        Wavelengths in it: those where the parameter has an uncertainty.
    """

    value: float
    sigma: float
    parts: Mapping[str, float]
    count: int


def mean_of_parameter(parts: Sequence[Part], values: Array, sigma: Array, place: int, weights: Array) -> Mean:
    """Return the mean of a parameter's values (W,) with weights (W,); those without a σ are left out."""
    good = np.isfinite(values) & np.isfinite(sigma) & (weights > 0.0)
    if not good.any():
        return Mean(float("nan"), float("nan"), {}, 0)
    share = np.where(good, weights, 0.0)
    share = share / share.sum()
    told = {part.name: math.sqrt(part.mean_variance(share, place)) for part in parts}
    value = float(share[good] @ values[good])
    return Mean(value, math.hypot(*told.values()), told, int(good.sum()))
