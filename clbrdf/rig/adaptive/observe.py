"""What a planner learns of a committed row: the point calibrated by itself, and the light of its rig."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from clbrdf.rig.adaptive.light import NoiseModel
from clbrdf.rig.alone import rows_alone
from clbrdf.rig.budget import Budget
from clbrdf.rig.calibrate import calibrate, grid_and_weights, incident_power, resample
from clbrdf.rig.exposure import saturation_limit
from clbrdf.rig.planfile import Plan
from clbrdf.rig.rawscan import RawScan
from clbrdf.rig.rigfile import Rig
from clbrdf.rig.row import Row
from clbrdf.rig.segment import read_header
from clbrdf.rig.store import Store, segments

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class CalibratedPoint:
    """One point.

    Attributes
    ----------
    angles : (4,) float64
        θi, φi, θr, φr read back, degrees.
    wavelength : (W,) float64
        nm.
    brdf : (W,) float64
        1/sr; NaN where it is no measurement.
    sigma : (W,) float64
        Standard uncertainty of what differs from point to point, 1/sr.
    """

    angles: Array
    wavelength: Array
    brdf: Array
    sigma: Array


class Observer(Protocol):
    """Where a planner's knowledge comes from."""

    def observe(self, row: Row) -> CalibratedPoint:
        """Return what a committed point that was not skipped shows."""

    def light(self, row: Row, wavelength: Array) -> NoiseModel:
        """Return the light at some wavelengths, nm, that a committed point was measured with."""


class StoredRows:
    """Observations from the rows of a running measurement.

    What is added up over all points alike (incident power, panel) is no part of the uncertainty: it moves
    the scale, and no choice of directions mends it.
    """

    def __init__(self, plan: Plan, rig: Rig, store: Store, budget: Budget) -> None:
        self.plan, self.rig, self.store, self.budget = plan, rig, store, budget

    def observe(self, row: Row) -> CalibratedPoint:
        """Calibrate a point by itself."""
        scan = calibrate(self._raw(row), self.budget)
        angles = np.array([scan.theta_i[0], scan.phi_i[0], scan.theta_r[0], scan.phi_r[0]])
        values = np.where(scan.mask[0], np.nan, scan.brdf[0])
        sigma = np.zeros(values.shape) if scan.random_sigma is None else scan.random_sigma[0]
        return CalibratedPoint(angles, scan.wavelength, values, sigma)

    def light(self, row: Row, wavelength: Array) -> NoiseModel:
        """Take incident power and dark level of a point."""
        raw = self._raw(row)
        grid, weights = grid_and_weights(raw.wavelength, self.plan.wavelength, raw.is_discrete)
        rate, _ = incident_power(raw, np.array([2]))
        places = np.abs(grid - wavelength[:, None]).argmin(axis=1)
        return NoiseModel(
            self.plan,
            self.rig,
            self.budget,
            np.maximum(resample(rate, weights)[0, places], 1e-12),
            1.0 / np.sum(weights[places] ** 2, axis=1),
            float(np.median(raw.rows["counts"][0] / raw.rows["scans"][0])),
            float(saturation_limit(raw.full_scale, self.rig.spectrometer)),
        )

    def _raw(self, row: Row) -> RawScan:
        return rows_alone(
            self.plan, self.rig, self.store, self._header(), [self.store.reference_of(row), row]
        )

    def _header(self) -> Mapping[str, str]:
        """Return what the instruments said; before they are connected again, the first segment tells."""
        if "wavelength" in self.store.header:
            return self.store.header
        return read_header(segments(self.store.folder)[0])
