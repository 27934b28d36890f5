"""The measurement itself: point after point, each one committed before the next, whatever happens.

A row is accepted only if nothing is left to doubt: the position was read back, the lamp's power was in
its band before and after the spectrum, the shutter had come to rest, light was not below dark, and the
stages were at rest and referenced afterwards. What an exchange cannot mend by being repeated ends in a
recovery: reopen, identify, home if need be, measure a check point again, then the point from its
beginning. What only a person can mend (no light, a lamp out of its band, a sample that moved) ends at
once, with words for it.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from clbrdf.progress import Report
from clbrdf.rig.connection import nobody
from clbrdf.rig.darks import Darks
from clbrdf.rig.errors import InstrumentError, LimitReachedError, StalledError, UnmendedError
from clbrdf.rig.eventlog import EventLog, now_text
from clbrdf.rig.exposure import Exposer, Exposure, ladder
from clbrdf.rig.instruments import Instruments
from clbrdf.rig.lampwatch import LampWatch
from clbrdf.rig.planfile import Plan
from clbrdf.rig.planner import Planner, Target
from clbrdf.rig.repeatability import compare
from clbrdf.rig.route import panel_pose
from clbrdf.rig.row import (
    CHECK,
    DIRECT,
    DISAGREE,
    NO_ROW,
    PANEL,
    POINT,
    REFERENCES,
    RUNG,
    SATURATED,
    SKIPPED,
    Row,
    nowhere,
)
from clbrdf.rig.sanity import is_below_dark, signal_to_noise
from clbrdf.rig.store import Store

T = TypeVar("T")

CHECK_SIGMA = 5.0
"""A check point may be this many of its own standard deviations off."""

CHANGED = "direct beam changed"
"""Kind of the event that a measurement reports at its end."""

MOST_DARK_LIGHTS = 3
"""How often a spectrum below its dark is taken again before a person has to look."""


def undisturbed(make_safe: Callable[[], None]) -> bool:
    """Nobody asks for a pause."""
    del make_safe
    return False


def ignore(row: Row) -> None:
    """Nobody watches."""
    del row


@dataclass
class InUse:
    """The row of the incident power, and how many rows have used it."""

    row: int
    used: int = 0


class Acquisition:
    """Takes every point that a planner asks for.

    Parameters
    ----------
    instruments : Instruments
        Connected.
    plan : Plan
    planner : Planner
        Told of every point that the store holds already.
    store : Store
    log : EventLog
    window : slice
        Pixels within the plan's wavelengths.
    check : callable
        Called between exchanges; raises `StoppedError` where the user wants to stop.
    pause : callable
        Called between points with what makes the rig safe; True where it has waited, and the rig may have
        been touched meanwhile.
    seen : callable
        Told each point as it is committed.
    ask : callable
        Puts a question to a person, who changes panel and sample.
    """

    def __init__(
        self,
        instruments: Instruments,
        plan: Plan,
        planner: Planner,
        store: Store,
        log: EventLog,
        window: slice,
        check: Callable[[], None],
        pause: Callable[[Callable[[], None]], bool] = undisturbed,
        seen: Callable[[Row], None] = ignore,
        ask: Callable[[str], str] = nobody,
    ) -> None:
        self.instruments = instruments
        self.settings = instruments.rig.spectrometer
        self.plan = plan
        self.planner = planner
        self.store = store
        self.log = log
        self.window = window
        self.check = check
        self.pause = pause
        self.seen = seen
        self.ask = ask
        spectrometer = instruments.spectrometer
        times = ladder(plan, spectrometer.shortest, spectrometer.longest)
        self.exposer = Exposer(spectrometer, self.settings, times, plan.scans, window, log, check)
        self.lamp = LampWatch(instruments.reference, instruments.rig.reference, log, check, store.base_power)
        self.is_automatic = plan.integration_time == "auto"
        self.darks = Darks(instruments.spectrometer, self.exposer, plan, store, check)
        self.reference: InUse | None = None
        # A resumed measurement cannot know what was done to the rig meanwhile.
        self.check_due = store.brightest is not None
        self.must_home = False

    def run(self, report: Report) -> None:
        """Measure.

        Raises
        ------
        InstrumentError
            A fault that did not go away; every committed row is safe.
        StorageError
            The disk is full.
        StoppedError
            The user asked to stop.
        """
        self._surely("homing", self.instruments.home)
        total = self.planner.total or 0
        report(len(self.store.points), total)
        while (target := self.planner.ask()) is not None:
            if self.pause(partial(self.exposer.set_shutter, False)):
                self.check_due = self.store.brightest is not None
                self.darks.forget()
                self.exposer.forget()
            self._surely(f"point {target.number}", partial(self._take, target))
            report(len(self.store.points), total)
        if self.store.last is None or self.store.last.kind not in REFERENCES:
            # What happened since the last incident power shows in one at the end.
            self._surely("closing direct beam", self._take_direct)

    def _surely(self, what: str, action: Callable[[], T]) -> T:
        """Do something until it succeeds, recovering in between."""
        attempts = self.instruments.rig.recovery.attempts
        error: InstrumentError | None = None
        for attempt in range(1, attempts + 1):
            self.check()
            try:
                if error is not None:
                    self._recover()
                return action()
            except UnmendedError:
                raise
            except InstrumentError as failure:
                error = failure
                # Stays due until it is done: the recovery itself may fail half-way.
                self.must_home |= self.instruments.calls_for_homing(failure)
                self.log.add("rig", "recovery", f"{what}, attempt {attempt} of {attempts}: {failure}")
        assert error is not None
        raise error

    def _recover(self) -> None:
        self.exposer.forget()
        if self.instruments.recover(self.must_home):
            self.must_home = False
            self.check_due = self.store.brightest is not None

    def _take(self, target: Target) -> None:
        """Measure and commit one point, with what it needs before."""
        if self.check_due:
            self._check_point()
            self.check_due = False
        if self.reference is None or self.reference.used >= self.plan.reference_every:
            self._take_direct()
        assert self.reference is not None
        last = self.store.points[-1] if self.store.points else None
        start = self.exposer.times[0] if last is None else last.integration_time
        if not self.is_automatic:
            start = self.exposer.times[-1]
        try:
            row = self._record(POINT, target.number, target.axes, start, self.reference.row, target.nominal)
        except LimitReachedError as error:
            self.log.add("rig", "point skipped", f"point {target.number}: {error}")
            self._commit(self._skipped(target))
            # A stage at its limit switch is homed before it is trusted again.
            self.must_home = True
            self._surely("leaving the limit switch", self._recover)
            return
        self._commit(row)
        self.reference.used += 1

    def _commit(self, row: Row) -> None:
        self.store.append(row)
        self.planner.tell(row)
        self.seen(row)

    def _skipped(self, target: Target) -> Row:
        counts = np.zeros(self.instruments.spectrometer.pixels, np.uint32)
        seconds = self.store.points[-1].integration_time if self.store.points else self.exposer.times[0]
        return Row(
            POINT,
            target.number,
            now_text(),
            np.full(3, np.nan),
            np.nan,
            seconds,
            NO_ROW,
            NO_ROW,
            SKIPPED,
            counts,
            target.nominal,
        )

    def _take_direct(self) -> None:
        """Measure the incident power: the lamp straight into the detector, or the panel in its place."""
        panel = self.instruments.rig.geometry.panel
        if panel is None:
            kind, axes = DIRECT, np.array(self.instruments.rig.geometry.direct)
        else:
            kind, axes = PANEL, panel_pose(self.instruments.rig)
            self.ask("put the reference panel in place of the sample, then press Enter")
        try:
            row = self._record(kind, NO_ROW, axes, self.exposer.times[0], NO_ROW, may_grow=True)
        except LimitReachedError as error:
            raise StalledError(f"{error}; the incident power cannot be measured") from error
        self._check_direct(row)
        if panel is not None:
            self.ask("put the sample back, then press Enter")
        self._compare_direct(row)
        self.lamp.accept(row.reference_power)
        self.reference = InUse(self.store.append(row))

    def _check_direct(self, row: Row) -> None:
        if row.flags & SATURATED:
            raise UnmendedError(
                f"the direct beam saturates the spectrometer at {row.integration_time:g} s;"
                " put a filter into the beam, or plan a smaller shortest_time"
            )
        light, dark = self._scan(row), self._scan(self.store.dark_of(row))
        ratio = signal_to_noise(light, dark, row.scans, self.settings)
        if not ratio >= self.settings.least_signal:
            net = float(np.median(light - dark))
            raise UnmendedError(
                f"the direct beam is {net:.3g} counts above dark at {row.integration_time:g} s, {ratio:.2g}"
                f" times its noise where {self.settings.least_signal:g} are needed: see that the lamp is on,"
                " the shutter opens, the fibre is in, and geometry.direct lets the lamp shine into it"
            )

    def _compare_direct(self, row: Row) -> None:
        """Say loudly where the direct beam, for one watt of the lamp, is not what it was the last time."""
        before = self.store.reference
        if before is None:
            return
        rows = [(before, self.store.dark_of(before)), (row, self.store.dark_of(row))]
        result = compare(rows, self.window, self.instruments.rig)
        if abs(result.sigmas) > CHECK_SIGMA:
            text = f"{result}; points measured since {before.time} may be off by as much"
            self.log.add("rig", CHANGED, text)

    def _check_point(self) -> None:
        """Measure the brightest committed point again, to see whether the rig stands where it stood."""
        first = self.store.brightest
        assert first is not None
        try:
            again = self._record(
                CHECK, first.point, first.axes, first.integration_time, first.direct, first.nominal, False
            )
        except LimitReachedError as error:
            raise StalledError(f"{error}; the check point cannot be measured") from error
        place = self.store.append(again)
        rows = [(first, self.store.dark_of(first)), (again, self.store.dark_of(again))]
        result = compare(rows, self.window, self.instruments.rig)
        self.log.add("rig", "check point", f"point {first.point}: {result} (row {place})")
        if abs(result.sigmas) > CHECK_SIGMA:
            raise UnmendedError(
                f"check point {first.point} is {result}, more than {CHECK_SIGMA:g}:"
                " look whether lamp, sample or stages have moved"
            )

    def _scan(self, row: Row) -> npt.NDArray[np.float64]:
        """Return the counts of a row, per scan, in the window."""
        return np.asarray(row.counts[self.window] / row.scans, dtype=np.float64)

    def _record(
        self,
        kind: int,
        point: int,
        target: npt.NDArray[np.float64],
        start: float,
        direct: int,
        nominal: npt.NDArray[np.float64] | None = None,
        may_grow: bool | None = None,
    ) -> Row:
        """Move, expose, make sure of lamp, shutter and stages, and see to a fresh dark."""
        for _ in range(MOST_DARK_LIGHTS):
            positions = self.instruments.stages.move(target.tolist())
            time.sleep(self.instruments.rig.stages.settle)
            # The reference detector may stand behind the shutter: it is read while that is open.
            self.exposer.set_shutter(True)
            before = self.lamp.wait()
            self.check()
            exposure = self.exposer.expose(start, self.is_automatic if may_grow is None else may_grow)
            hdr = self.plan.hdr if kind in (POINT, *REFERENCES) else 0
            rungs = self.exposer.longer(exposure, hdr)
            power = (before + self.lamp.measure()) / 2.0
            self.instruments.stages.check_ready()
            moment = now_text()
            temperature = self.instruments.spectrometer.get_temperature()
            axes = np.array(positions)
            dark = self.darks.row_for(exposure, axes, power, temperature)
            row = Row(
                kind,
                point,
                moment,
                axes,
                power,
                exposure.seconds,
                dark,
                direct,
                SATURATED if exposure.saturated else 0,
                exposure.counts,
                nowhere() if nominal is None else nominal,
                exposure.scans,
                temperature,
            )
            light, below = self._scan(row), self._scan(self.store.dark_of(row))
            if not is_below_dark(light, below, row.scans, self.settings):
                return self._with_rungs(row, rungs) if rungs else row
            self.log.add("spectrometer", "light below dark", f"by {float((below - light).mean()):.3g} counts")
            self.darks.forget()
            self.exposer.forget()
        raise UnmendedError(
            "spectrometer: spectra with the shutter open are darker than those with it closed; see whether"
            " the shutter moves, which way round it is wired, and whether other light falls in"
        )

    def _with_rungs(self, row: Row, rungs: list[Exposure]) -> Row:
        """Commit the longer exposures of a row and return the row with its chain, the longest last in it."""
        place, flags = NO_ROW, row.flags
        for exposure in reversed(rungs):
            dark = self.darks.row_for(exposure, row.axes, row.reference_power, row.temperature)
            longer = Row(
                RUNG,
                row.point,
                row.time,
                row.axes,
                row.reference_power,
                exposure.seconds,
                dark,
                row.direct,
                SATURATED if exposure.saturated else 0,
                exposure.counts,
                row.nominal,
                exposure.scans,
                row.temperature,
                place,
            )
            if not self._overlap_agrees(row, longer):
                flags |= DISAGREE
            place = self.store.append(longer)
        return replace(row, flags=flags, rung=place)

    def _overlap_agrees(self, row: Row, longer: Row) -> bool:
        """Compare two integration times at the pixels where neither is saturated."""
        usable = longer.counts[self.window] < self.exposer.limit * longer.scans
        rows = [(row, self.store.dark_of(row)), (longer, self.store.dark_of(longer))]
        result = compare(rows, self.window, self.instruments.rig, usable, same_place=True)
        if abs(result.sigmas) <= CHECK_SIGMA:
            return True
        text = f"{row.integration_time:g} s and {longer.integration_time:g} s: {result}"
        self.log.add("spectrometer", "rungs disagree", text)
        return False
