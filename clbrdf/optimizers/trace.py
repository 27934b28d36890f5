"""What an optimizer did: evaluations counted, the best point kept, every improvement noted."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import cast

import numpy as np
import numpy.typing as npt

from clbrdf.geometry import read_only
from clbrdf.optimizers.objective import Objective, Values

Array = npt.NDArray[np.float64]


class Finished(Exception):  # noqa: N818 (not an error: the budget is spent or the target reached)
    """Ends an optimizer from within its objective."""


@dataclass(frozen=True, eq=False)
class Trace:
    """One run of one optimizer; immutable.

    Attributes
    ----------
    optimizer : str
    seed : int
    evaluations, seconds, objective : (T,) int64, float64, float64
        At each improvement: evaluations spent, wall time since the start, best E so far.
    coordinates : (P,) float64
        The best point.
    spent : int
        Evaluations in all; a value with its gradient counts as two.
    elapsed : float
        Seconds in all.
    """

    optimizer: str
    seed: int
    evaluations: npt.NDArray[np.int64]
    seconds: Array
    objective: Array
    coordinates: Array
    spent: int
    elapsed: float

    def __post_init__(self) -> None:
        for name in ("evaluations", "seconds", "objective", "coordinates"):
            read_only(getattr(self, name))

    @property
    def best(self) -> float:
        """Lowest E seen."""
        return float(self.objective[-1]) if len(self.objective) else float("inf")

    def cost_to(self, target: float) -> tuple[float, float]:
        """Return evaluations and seconds until E ≤ target; infinite where it was not reached."""
        place = int(np.searchsorted(-self.objective, -target, side="left"))
        if place == len(self.objective):
            return float("inf"), float("inf")
        return float(self.evaluations[place]), float(self.seconds[place])


class Recorder:
    """An objective that counts, remembers, and raises Finished when the run is over.

    Parameters
    ----------
    objective : Objective or Values
        Without derivatives for optimizers that use none.
    evaluations : int
        Budget.
    target : float
        Stop at the first E at or below it.
    seconds : float
        Stop at the first evaluation after so much wall time.
    """

    def __init__(
        self, objective: Values, evaluations: int, target: float = -np.inf, seconds: float = np.inf
    ) -> None:
        self.objective, self.budget, self.target = cast(Objective, objective), evaluations, target
        self.lower, self.upper = objective.lower, objective.upper
        self.spent, self.best, self._seconds = 0, np.inf, seconds
        self.coordinates = 0.5 * (self.lower + self.upper)
        self._notes: list[tuple[int, float, float]] = []
        self._start = time.perf_counter()
        self._last: tuple[bytes, Array] | None = None

    @property
    def finished(self) -> bool:
        """Whether the budget is spent, the time is over, or the target reached."""
        over = time.perf_counter() - self._start > self._seconds
        return over or self.spent >= self.budget or self.best <= self.target

    @property
    def left(self) -> int:
        """Evaluations left."""
        return max(0, self.budget - self.spent)

    def value(self, q: Array) -> float:
        """E at coordinates (P,); counts one."""
        return float(self.values(np.asarray(q)[None])[0])

    def values(self, q: Array) -> Array:
        """E (K,) at coordinates (K, P); counts K. What exceeds the budget is not evaluated."""
        self._check()
        inside = np.clip(q[: self.left], self.lower, self.upper)
        E = self.objective.values(inside)
        for k in np.flatnonzero(np.minimum.accumulate(np.append(self.best, E[:-1])) > E):
            self._keep(inside[k], float(E[k]), self.spent + int(k) + 1)
        self.spent += len(E)
        if len(E) < len(q):
            raise Finished
        return E

    def value_and_gradient(self, q: Array) -> tuple[float, Array]:
        """E and its gradient at coordinates (P,); counts two."""
        self._check()
        inside = np.clip(q, self.lower, self.upper)
        E, gradient = self.objective.value_and_gradient(inside)
        self.spent += 2
        self._keep(inside, E, self.spent)
        return E, gradient

    def residuals(self, q: Array) -> Array:
        """Residuals (N,) at coordinates (P,); counts one."""
        self._check()
        r, jacobian = self.objective.residuals(np.clip(q, self.lower, self.upper))
        self._last = (q.tobytes(), jacobian)
        self.spent += 1
        with np.errstate(all="ignore"):
            self._keep(q, float(r @ r), self.spent)
        return r

    def residual_jacobian(self, q: Array) -> Array:
        """Their derivatives (N, P); counts one."""
        self._check()
        self.spent += 1
        if self._last is not None and self._last[0] == q.tobytes():
            return self._last[1]
        return self.objective.residuals(np.clip(q, self.lower, self.upper))[1]

    def trace(self, optimizer: str, seed: int) -> Trace:
        """Return the record of the run so far."""
        columns = np.array(self._notes, dtype=np.float64).reshape(-1, 3).T
        return Trace(
            optimizer=optimizer,
            seed=seed,
            evaluations=columns[0].astype(np.int64),
            seconds=columns[1].copy(),
            objective=columns[2].copy(),
            coordinates=self.coordinates.copy(),
            spent=self.spent,
            elapsed=time.perf_counter() - self._start,
        )

    def _check(self) -> None:
        if self.finished:
            raise Finished

    def _keep(self, q: Array, E: float, spent: int) -> None:
        if self.best > E:
            self.best, self.coordinates = E, np.array(q)
            self._notes.append((spent, time.perf_counter() - self._start, E))
