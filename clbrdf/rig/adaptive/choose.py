"""The next batch: where the model's information per second is largest, and where nothing was measured."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clbrdf.rig.adaptive.candidates import CandidatePoints
from clbrdf.rig.adaptive.knowledge import Knowledge
from clbrdf.rig.adaptive.score import scores, with_one_more
from clbrdf.rig.adaptive.settings import Adaptive
from clbrdf.rig.adaptive.spread import apart, coordinates, nearest_taken
from clbrdf.rig.rigfile import Rig
from clbrdf.rig.route import overhead

Array = npt.NDArray[np.float64]


class Picks:
    """Candidates taken so far and those that may still be taken.

    Attributes
    ----------
    chosen : list of int
        Of this batch.
    free : (N,) bool
        Not nearer than the least separation to any that was taken.
    """

    def __init__(self, candidates: CandidatePoints, separation: float, taken: list[int]) -> None:
        self.candidates, self.separation = candidates, separation
        self.chosen: list[int] = []
        self.free = np.ones(len(candidates), bool)
        self._space = coordinates(candidates.directions)
        self._left = nearest_taken(self._space, taken)
        for place in taken:
            self._block(place)

    def take(self, place: int) -> None:
        """Take one."""
        self.chosen.append(place)
        self._block(place)
        distance = np.sqrt(np.sum((self._space - self._space[place]) ** 2, axis=1))
        self._left = np.minimum(self._left, distance)

    def take_farthest(self, count: int) -> None:
        """Take those that are farthest from all that were taken, one after the other."""
        for _ in range(count):
            if self.free.any():
                self.take(int(np.argmax(np.where(self.free, self._left, -1.0))))

    def _block(self, place: int) -> None:
        self.free &= apart(self.candidates.directions, place) >= self.separation - 1e-9
        self.free[place] = False


def choose_batch(
    candidates: CandidatePoints,
    settings: Adaptive,
    rig: Rig,
    knowledge: Knowledge | None,
    metric: Array | None,
    taken: list[int],
    here: Array,
) -> tuple[list[int], list[int]]:
    """Choose the next points.

    Parameters
    ----------
    candidates, settings, rig
        Of the plan.
    knowledge : Knowledge or None
        None where nothing could be fitted: the batch fills space.
    metric : (W, F, F) float64 or None
        What is asked for (`score`).
    taken : list of int
        Candidates measured so far.
    here : (3,) float64
        Axis angles from which the stages start, degrees.

    Returns
    -------
    fitted, kept : list of int
        Candidates for the fit and for its validation; fewer than a batch where no more are free.
    """
    picks = Picks(candidates, settings.separation, taken)
    fitted = settings.batch - settings.validation
    if knowledge is not None:
        count = fitted - max(1, round(settings.spread * fitted))
        _take_informative(picks, rig, knowledge, metric, here, count)
    picks.take_farthest(fitted - len(picks.chosen))
    end = len(picks.chosen)
    # The validation stands where the fit matters and where nobody looked, in turn.
    for number in range(settings.validation):
        if knowledge is not None and (len(taken) // settings.batch + number) % 2:
            _take_informative(picks, rig, knowledge, metric, here, 1)
        else:
            picks.take_farthest(1)
    return picks.chosen[:end], picks.chosen[end:]


def _take_informative(
    picks: Picks, rig: Rig, knowledge: Knowledge, metric: Array | None, here: Array, count: int
) -> None:
    """Take the candidates that add most per second of travel, exposure and exchanges, one after the other."""
    candidates, cov = picks.candidates, knowledge.cov
    _, jacobian, sigma, seconds = knowledge.predict(candidates.directions)
    fixed = overhead(rig)
    for _ in range(count):
        if not picks.free.any():
            return
        worth = scores(jacobian, sigma, cov, metric) / (candidates.travel(here, rig) + seconds + fixed)
        place = int(np.argmax(np.where(picks.free, worth, -1.0)))
        picks.take(place)
        cov = with_one_more(cov, jacobian[:, place], sigma[:, place])
        here = candidates.axes[place][0 if np.isfinite(candidates.axes[place, 0, 0]) else 1]
