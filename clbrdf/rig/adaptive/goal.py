"""The target of an adaptive plan: what it measures, how far it is, whether it can be reached."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clbrdf.geometry import Directions, cos_deg, sin_deg
from clbrdf.rig.adaptive.knowledge import Knowledge
from clbrdf.rig.adaptive.score import field_metric, invert, parameter_metric, reached
from clbrdf.rig.adaptive.settings import Adaptive

Array = npt.NDArray[np.float64]

FIELD_STEP, FIELD_END = 7.5, 82.5
"""Grid over which the BRDF's uncertainty is averaged, degrees."""


class Goal:
    """What is asked for.

    Parameters
    ----------
    settings : Adaptive
    incident : (I,) float64
        Incident zeniths of the plan, degrees.
    """

    def __init__(self, settings: Adaptive, incident: Array) -> None:
        self.settings = settings
        zenith, azimuth = np.arange(FIELD_STEP, FIELD_END + 1.0, FIELD_STEP), np.arange(0.0, 360.0, 15.0)
        grid = np.stack(np.meshgrid(incident, zenith, azimuth, indexing="ij"), axis=-1).reshape(-1, 3)
        self._field = Directions.relative(*grid.T)
        self._weight = cos_deg(grid[:, 1]) * sin_deg(grid[:, 1])

    def metric(self, knowledge: Knowledge) -> Array | None:
        """M (W, F, F) of `score`; None where only time is given, and everything counts."""
        if self.settings.sigma is not None:
            places = [knowledge.model.names.index(name) for name in self.settings.parameters]
            return parameter_metric(knowledge.estimates(), [knowledge.free.index(place) for place in places])
        if self.settings.hemisphere is not None:
            brdf, jacobian, _, _ = knowledge.predict(self._field)
            return field_metric(jacobian, brdf, self._weight)
        return None

    def reached(self, cov: Array, metric: Array | None) -> float:
        """Relative standard uncertainty at the worst wavelength; NaN without a target."""
        if metric is None:
            return float("nan")
        return float(reached(cov, metric, max(1, len(self.settings.parameters))).max())

    def bound(
        self, knowledge: Knowledge, metric: Array | None, free: npt.NDArray[np.bool_], directions: Directions
    ) -> float:
        """Return what measuring every direction that is left would reach: no plan does better."""
        if metric is None or not free.any():
            return self.reached(knowledge.cov, metric)
        _, jacobian, sigma, _ = knowledge.predict(directions)
        weighted = (jacobian / sigma[..., None])[:, free]
        more = np.einsum("wnp,wnq->wpq", weighted, weighted)
        return self.reached(invert(np.linalg.inv(knowledge.cov) + more), metric)
