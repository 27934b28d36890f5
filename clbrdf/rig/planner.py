"""Who says where to look next: asked for a target, told of each row that came of it.

A planner's answers follow from its plan and from the rows that it was told, and from nothing else: a
measurement that is resumed tells it all rows again and goes on where it was.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from clbrdf.rig.route import Route
from clbrdf.rig.row import Row


@dataclass(frozen=True, eq=False)
class Target:
    """The next point.

    Attributes
    ----------
    number : int
        Of the point in its plan; no two points of a measurement have the same.
    nominal : (4,) float64
        θi, φi, θr, φr asked for, degrees.
    axes : (3,) float64
        Rig angles lamp, turn, pitch that give it, degrees.
    """

    number: int
    nominal: npt.NDArray[np.float64]
    axes: npt.NDArray[np.float64]


class Planner(Protocol):
    """Chooses the points of a measurement."""

    @property
    def total(self) -> int | None:
        """Points in all; None where that is not known beforehand."""

    def ask(self) -> Target | None:
        """Return the next target; the same one until a row for it was told; None when all is done."""

    def tell(self, row: Row) -> None:
        """Take notice of a committed point, skipped ones included."""


class FixedRoute:
    """Every point of a route, in its order."""

    def __init__(self, route: Route) -> None:
        self.route = route
        self._done: set[int] = set()
        self._next = 0

    @property
    def total(self) -> int:
        """Points of the route."""
        return len(self.route)

    def ask(self) -> Target | None:
        """Return the first point that was not told yet."""
        while self._next in self._done:
            self._next += 1
        if self._next >= len(self.route):
            return None
        k, d = self._next, self.route.directions
        nominal = np.array([d.theta_i[k], d.phi_i[k], d.theta_r[k], d.phi_r[k]])
        return Target(k, nominal, self.route.axes[k])

    def tell(self, row: Row) -> None:
        """Count a point as done."""
        self._done.add(row.point)
