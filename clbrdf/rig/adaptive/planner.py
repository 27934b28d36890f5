"""The adaptive planner: a uniform start, then batch after batch, until a target is reached.

What it asks for follows from the plan and from the committed rows alone. The number of a point tells its
batch and whether it is kept for validation; so a resumed measurement needs to work out the batch that it is
in, and no other.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.models import get_model
from clbrdf.rig.adaptive.candidates import CandidatePoints
from clbrdf.rig.adaptive.choose import Picks, choose_batch
from clbrdf.rig.adaptive.goal import Goal
from clbrdf.rig.adaptive.knowledge import Knowledge, learn, light_wavelengths
from clbrdf.rig.adaptive.observe import CalibratedPoint, Observer
from clbrdf.rig.adaptive.settings import Adaptive
from clbrdf.rig.adaptive.spread import uniform_start
from clbrdf.rig.planner import Target
from clbrdf.rig.rigfile import Rig
from clbrdf.rig.route import order_points, overhead, travel_times
from clbrdf.rig.row import SKIPPED, Row
from clbrdf.rig.stagesettings import AXES, StageSettings

Array = npt.NDArray[np.float64]

ENDED, DOUBTED = "end", "end in doubt"
"""Kinds of the last event. In doubt: the target is not reached, or the model does not fit the surface."""


@dataclass(frozen=True, eq=False)
class Batch:
    """Points to take one after the other, the validation last.

    Attributes
    ----------
    first : int
        Number of its first point.
    places : tuple of int
        CandidatePoints.
        None: the plan has come to its end.
    axes : (n, 3) float64
        Where the stages go, degrees.
    """

    first: int
    places: tuple[int, ...]
    axes: Array


@dataclass(frozen=True, eq=False)
class State:
    """How far a plan is.

    Attributes
    ----------
    points : int
    seconds : float
        Of the rig, as estimated.
    reached : float
        Relative standard uncertainty of what the target is of; NaN without one.
    knowledge : Knowledge or None
    """

    points: int
    seconds: float
    reached: float
    knowledge: Knowledge | None


class AdaptivePlanner:
    """Chooses the points of a measurement from those measured.

    Parameters
    ----------
    settings : Adaptive
    candidates : CandidatePoints
    rig : Rig
    observer : Observer
        Calibrates the rows.
    say : callable
        Told (kind, text) of each batch and of the end.

    Attributes
    ----------
    states : list of State
        After each batch that was worked out, the last one at the end.
    """

    def __init__(
        self,
        settings: Adaptive,
        candidates: CandidatePoints,
        rig: Rig,
        observer: Observer,
        say: Callable[[str, str], None],
    ) -> None:
        self.settings, self.candidates, self.rig = settings, candidates, rig
        self.observer, self.say = observer, say
        self.model = get_model(settings.model)
        self.goal = Goal(settings, np.unique(candidates.directions.theta_i))
        self.states: list[State] = []
        self._rows: list[Row] = []
        self._seen: dict[int, CalibratedPoint] = {}
        self._batch: Batch | None = None
        self._said_bound = False
        self._place_of = {tuple(candidates.nominal(k)): k for k in range(len(candidates))}
        start = uniform_start(candidates.directions, min(settings.start, settings.points))
        self._kept_of_start = len(start) * settings.validation // settings.batch
        fitted = len(start) - self._kept_of_start
        self._start = self._ordered(0, start[:fitted], start[fitted:], np.zeros(3))

    @property
    def total(self) -> int | None:
        """Not known beforehand."""
        return None

    def tell(self, row: Row) -> None:
        """Take notice of a committed point."""
        if row.point == len(self._rows):
            self._rows.append(row)

    def ask(self) -> Target | None:
        """Return the next target; None when the plan has come to its end."""
        number = len(self._rows)
        batch = self._current(number)
        while number >= batch.first + len(batch.places):
            if not batch.places:
                return None
            batch = self._batch = self._decide(batch.first + len(batch.places))
        place = number - batch.first
        return Target(number, self.candidates.nominal(batch.places[place]), batch.axes[place])

    def is_validation(self, number: int) -> bool:
        """Whether a point is kept out of the fit."""
        settings, start = self.settings, len(self._start.places)
        if number < start:
            return number >= start - self._kept_of_start
        return (number - start) % settings.batch >= settings.batch - settings.validation

    def _current(self, number: int) -> Batch:
        """Return the batch that a point is in; after a resumption it is worked out anew."""
        start = len(self._start.places)
        if number < start:
            return self._start
        first = start + (number - start) // self.settings.batch * self.settings.batch
        if self._batch is None or self._batch.first < first:
            self._batch = self._decide(first)
        return self._batch

    def _decide(self, first: int) -> Batch:
        """Choose the batch that begins with a number, from the rows before it."""
        rows = self._rows[:first]
        taken = [self._place_of[tuple(row.nominal)] for row in rows]
        knowledge = self._learn(rows)
        metric = self.goal.metric(knowledge) if knowledge else None
        reached = self.goal.reached(knowledge.cov, metric) if knowledge else float("nan")
        here, seconds = self._spent(taken)
        state = State(first, seconds, reached, knowledge)
        self.states.append(state)
        self.say("batch", self._words(state))
        end = self._end(state)
        if end:
            return self._last(first, end, state)
        picks = Picks(self.candidates, self.settings.separation, taken)
        self._say_bound(knowledge, metric, picks)
        fitted, kept = choose_batch(self.candidates, self.settings, self.rig, knowledge, metric, taken, here)
        batch = self._cut(self._ordered(first, fitted, kept, here), seconds, here, knowledge)
        if not batch.places:
            left = "time" if picks.free.any() else "direction"
            return self._last(first, f"no {left} is left{self._missed(state)}", state)
        return batch

    def _last(self, first: int, why: str, state: State) -> Batch:
        """Say why the plan ends, and return a batch of no points."""
        self.say(DOUBTED if self._is_doubtful(state) else ENDED, f"{why}; {self._words(state)}")
        return Batch(first, (), np.empty((0, 3)))

    def _is_doubtful(self, state: State) -> bool:
        is_wrong = state.knowledge is None or state.knowledge.misfit.is_wrong
        return is_wrong or bool(self._missed(state))

    def _learn(self, rows: list[Row]) -> Knowledge | None:
        good = [row for row in rows if not row.flags & SKIPPED]
        if not good:
            return None
        for row in good:
            if row.point not in self._seen:
                self._seen[row.point] = self.observer.observe(row)
        seen = [self._seen[row.point] for row in good if not self.is_validation(row.point)]
        kept = [self._seen[row.point] for row in good if self.is_validation(row.point)]
        if not seen:
            return None
        wavelength = light_wavelengths(seen, self.settings.wavelengths)
        light = self.observer.light(good[-1], wavelength)
        return learn(self.settings, self.model, seen, kept, light)

    def _ordered(self, first: int, fitted: list[int], kept: list[int], here: Array) -> Batch:
        """Arrange points so that the stages travel little; the validation comes last."""
        places: list[int] = []
        axes = [np.empty((0, 3))]
        for part in (fitted, kept):
            if part:
                order, poses = order_points(self.candidates.axes[part], self._speeds(), "shortest", here)
                places += [part[k] for k in order]
                axes.append(poses)
                here = poses[-1]
        return Batch(first, tuple(places), np.concatenate(axes))

    def _cut(self, batch: Batch, seconds: float, here: Array, knowledge: Knowledge | None) -> Batch:
        """Drop the points that exceed time or number."""
        count = min(len(batch.places), self.settings.points - batch.first)
        if self.settings.time is not None and count:
            travel = travel_times(np.diff(batch.axes[:count], axis=0, prepend=here[None]), self._speeds())
            each = travel + self._exposures(list(batch.places[:count]), knowledge) + overhead(self.rig)
            count = int(np.sum(seconds + np.cumsum(each) <= self.settings.time))
        return Batch(batch.first, batch.places[:count], batch.axes[:count])

    def _spent(self, taken: list[int]) -> tuple[Array, float]:
        """Where the stages stand after the points taken, and the seconds that they took."""
        here, poses = np.zeros(3), []
        speeds = self._speeds()
        for place in taken:
            times = travel_times(self.candidates.axes[place] - here, speeds)
            here = self.candidates.axes[place][int(np.nanargmin(times))]
            poses.append(here)
        if not poses:
            return here, 0.0
        travel = travel_times(np.diff(np.array(poses), axis=0, prepend=np.zeros((1, 3))), speeds)
        exposures = np.array([row.integration_time * row.scans for row in self._rows[: len(taken)]])
        return here, float(travel.sum() + exposures.sum() + len(taken) * overhead(self.rig))

    def _exposures(self, places: list[int], knowledge: Knowledge | None) -> Array:
        if knowledge is None:
            return np.full(len(places), self._rows[-1].integration_time if self._rows else 0.0)
        return knowledge.predict(self.candidates.directions[np.array(places)])[3]

    def _speeds(self) -> list[StageSettings]:
        return [getattr(self.rig.stages, name) for name in AXES]

    def _end(self, state: State) -> str:
        """Say why the plan ends here; "" where it goes on."""
        settings = self.settings
        if settings.target is not None and state.reached <= settings.target:
            return "the target is reached"
        if state.points >= settings.points:
            return (
                f"{settings.points} points are measured, the most that the plan allows{self._missed(state)}"
            )
        if settings.time is not None and state.seconds >= settings.time:
            return f"the time is spent{self._missed(state)}"
        return ""

    def _missed(self, state: State) -> str:
        if self.settings.target is None or state.reached <= self.settings.target:
            return ""
        return ", and the target is not reached"

    def _say_bound(self, knowledge: Knowledge | None, metric: Array | None, picks: Picks) -> None:
        """Say once where even all directions that are left would not do."""
        target = self.settings.target
        if knowledge is None or target is None or self._said_bound:
            return
        best = self.goal.bound(knowledge, metric, picks.free, self.candidates.directions)
        if not best <= target:
            self._said_bound = True
            self.say(
                "target out of reach",
                f"all {int(picks.free.sum())} directions that are left would bring {self.settings.what()} to"
                f" {best:.2%}, and the target is {target:.2%}; plan more directions, a smaller separation,"
                " longer exposures or more scans",
            )

    def _words(self, state: State) -> str:
        parts = [f"{state.points} points, {state.seconds:.0f} s of the rig"]
        if state.knowledge is None:
            return f"{parts[0]}, nothing to fit yet"
        if self.settings.target is not None:
            parts.append(f"{self.settings.what()} {state.reached:.2%}, target {self.settings.target:.2%}")
        misfit = state.knowledge.misfit
        if misfit.points:
            parts.append(
                f"{misfit.points} validation points off by {misfit.relative:.1%} rms, chi² {misfit.chi2:.3g}"
            )
            if misfit.is_wrong:
                parts.append(f"{self.settings.model} does not describe this surface: its sigma means little")
        return ", ".join(parts)
