"""A measurement while it runs: each point calibrated as it comes, and the time that is left."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from clbrdf.rig.alone import rows_alone
from clbrdf.rig.budget import Budget
from clbrdf.rig.calibrate import calibrate
from clbrdf.rig.planfile import Plan
from clbrdf.rig.rigfile import Rig
from clbrdf.rig.row import SKIPPED, Row
from clbrdf.rig.store import Store

RECENT = 20
"""Points from whose pace the time left is estimated."""


@dataclass(frozen=True, eq=False)
class Snapshot:
    """The latest point.

    Attributes
    ----------
    done, total : int
        Points so far and in all; a total of 0 is not known.
    row : Row
    wavelength, brdf, sigma : (W,) float64
        nm and 1/sr; empty where the point was skipped.
    remaining : float
        Seconds to the end; NaN while nothing is known.
    """

    done: int
    total: int
    row: Row
    wavelength: npt.NDArray[np.float64]
    brdf: npt.NDArray[np.float64]
    sigma: npt.NDArray[np.float64]
    remaining: float


@dataclass
class Live:
    """Makes a snapshot of each committed point and shows it.

    Attributes
    ----------
    plan, rig, store, total
        Of the measurement.
    budget : Budget
        For the uncertainties.
    show : callable
        Told each snapshot.
    """

    plan: Plan
    rig: Rig
    store: Store
    total: int
    budget: Budget
    show: Callable[[Snapshot], None]
    _moments: list[float] = field(default_factory=lambda: [time.monotonic()])

    def point(self, row: Row) -> None:
        """Show a point that was committed."""
        self._moments = [*self._moments[-RECENT:], time.monotonic()]
        done = len(self.store.points)
        pace = (self._moments[-1] - self._moments[0]) / max(1, len(self._moments) - 1)
        remaining = pace * (self.total - done) if self.total else float("nan")
        empty = np.empty(0)
        reference = self.store.reference
        if row.flags & SKIPPED or reference is None:
            self.show(Snapshot(done, self.total, row, empty, empty, empty, remaining))
            return
        raw = rows_alone(self.plan, self.rig, self.store, self.store.header, [reference, row])
        scan = calibrate(raw, self.budget)
        assert scan.sigma is not None
        values = np.where(scan.mask[0], np.nan, scan.brdf[0])
        self.show(Snapshot(done, self.total, row, scan.wavelength, values, scan.sigma[0], remaining))
