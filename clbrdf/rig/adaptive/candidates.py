"""The directions among which a planner chooses: those of the plan's grid that the axes reach."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.geometry import Directions
from clbrdf.rig.adaptive.settings import LEAST_INCIDENT
from clbrdf.rig.planfile import Plan
from clbrdf.rig.rigfile import Rig
from clbrdf.rig.route import reachable, travel_times
from clbrdf.rig.stagesettings import AXES

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class CandidatePoints:
    """N directions and how the axes get there.

    Attributes
    ----------
    directions : Directions
    axes : (N, 2, 3) float64
        Both solutions, degrees; NaN where one is out of reach.
    planned : int
        Directions of the plan.
    unreachable : mapping of str to int
        How many of them were left out, by reason.
    """

    directions: Directions
    axes: Array
    planned: int
    unreachable: dict[str, int]

    def __len__(self) -> int:
        return len(self.axes)

    def nominal(self, place: int) -> Array:
        """θi, φi, θr, φr (4,) of one, degrees."""
        d = self.directions
        return np.array([d.theta_i[place], d.phi_i[place], d.theta_r[place], d.phi_r[place]])

    def travel(self, here: Array, rig: Rig) -> Array:
        """Seconds (N,) from axis angles (3,), by the nearer solution."""
        stages = [getattr(rig.stages, name) for name in AXES]
        return np.asarray(np.nanmin(travel_times(self.axes - here, stages), axis=1))


def make_candidates(plan: Plan, rig: Rig) -> CandidatePoints:
    """Return what a plan's grid leaves to choose from.

    Raises
    ------
    InputError
        Fewer than three incident angles can be reached.
    """
    directions = plan.directions()
    axes, reasons = reachable(directions, rig)
    usable = np.nonzero(~np.isnan(axes[..., 0]).all(axis=1))[0]
    incident = np.unique(directions.theta_i[usable])
    if len(incident) < LEAST_INCIDENT:
        words = ", ".join(f"{angle:g}°" for angle in incident) or "none"
        raise InputError(
            f"[adaptive] needs {LEAST_INCIDENT} incident angles that the axes reach, and theta_i leaves"
            f" {words}; give more, or leave [adaptive] out for a fixed route"
        )
    counts = {str(r): int(np.count_nonzero(reasons == r)) for r in dict.fromkeys(reasons.tolist()) if r}
    return CandidatePoints(directions[usable], axes[usable], len(directions), counts)
