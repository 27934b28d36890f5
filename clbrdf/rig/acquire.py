"""The measurement itself: point after point, each one committed before the next, whatever happens.

A row is accepted only if nothing is left to doubt: the position was read back, the lamp's power was in
its band before and after the spectrum, and the stages were at rest and referenced afterwards. What an
exchange cannot mend by being repeated ends in a recovery: reopen, identify, home if need be, measure a
check point again, then the point from its beginning.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from clbrdf.progress import Report
from clbrdf.rig.errors import InstrumentError, LimitReachedError, OutOfBandError, StalledError
from clbrdf.rig.eventlog import EventLog, now_text
from clbrdf.rig.exposure import Exposure, expose, ladder
from clbrdf.rig.instruments import Instruments
from clbrdf.rig.planfile import Plan
from clbrdf.rig.route import Route
from clbrdf.rig.row import CHECK, DARK, DIRECT, NO_ROW, POINT, SATURATED, SKIPPED, Row
from clbrdf.rig.store import Store

T = TypeVar("T")


@dataclass
class Freshness:
    """A dark or direct row, and how many rows have used it."""

    row: int
    used: int = 0


class Acquisition:
    """Takes every point of a route that the store does not hold yet.

    Parameters
    ----------
    instruments : Instruments
        Connected.
    plan, route : Plan, Route
    store : Store
    log : EventLog
    window : slice
        Pixels within the plan's wavelengths.
    check : callable
        Called between exchanges; raises `StoppedError` where the user wants to stop.
    """

    def __init__(
        self,
        instruments: Instruments,
        plan: Plan,
        route: Route,
        store: Store,
        log: EventLog,
        window: slice,
        check: Callable[[], None],
    ) -> None:
        self.instruments = instruments
        self.plan = plan
        self.route = route
        self.store = store
        self.log = log
        self.window = window
        self.check = check
        self.times = ladder(plan, instruments.spectrometer.shortest)
        self.is_automatic = plan.integration_time == "auto"
        self.base_power = store.base_power
        self.darks: dict[float, Freshness] = {}
        self.direct: Freshness | None = None
        # A resumed measurement cannot know what was done to the rig meanwhile.
        self.check_due = store.last is not None
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
        total = len(self.route)
        report(len(self.store.done), total)
        for point in range(total):
            if point not in self.store.done:
                self._surely(f"point {point}", partial(self._take, point))
                report(len(self.store.done), total)

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
            except InstrumentError as failure:
                error = failure
                # Stays due until it is done: the recovery itself may fail half-way.
                self.must_home |= self.instruments.calls_for_homing(failure)
                self.log.add("rig", "recovery", f"{what}, attempt {attempt} of {attempts}: {failure}")
        assert error is not None
        raise error

    def _recover(self) -> None:
        if self.instruments.recover(self.must_home):
            self.must_home = False
            self.check_due = self.store.last is not None

    def _take(self, point: int) -> None:
        """Measure and commit one point, with what it needs before."""
        if self.check_due:
            self._check_point()
            self.check_due = False
        if self.direct is None or self.direct.used >= self.plan.reference_every:
            self._take_direct()
        assert self.direct is not None
        last = self.store.last
        fixed = self.times[-1]
        start = self.times[0] if last is None else last.integration_time
        try:
            row = self._record(
                POINT, point, self.route.axes[point], start if self.is_automatic else fixed, self.direct.row
            )
        except LimitReachedError as error:
            self.log.add("rig", "point skipped", f"point {point}: {error}")
            self.store.append(self._skipped(point))
            # A stage at its limit switch is homed before it is trusted again.
            self.must_home = True
            self._surely("leaving the limit switch", self._recover)
            return
        self.store.append(row)
        self.direct.used += 1

    def _skipped(self, point: int) -> Row:
        counts = np.zeros(self.instruments.spectrometer.pixels, np.uint16)
        axes = np.full(3, np.nan)
        return Row(POINT, point, now_text(), axes, np.nan, self._carried(), NO_ROW, NO_ROW, SKIPPED, counts)

    def _carried(self) -> float:
        return self.times[0] if self.store.last is None else self.store.last.integration_time

    def _take_direct(self) -> None:
        """Measure the incident power: the lamp straight into the detector."""
        axes = np.array(self.instruments.rig.geometry.direct)
        try:
            row = self._record(DIRECT, NO_ROW, axes, self.times[0], NO_ROW, may_grow=True)
        except LimitReachedError as error:
            raise StalledError(f"{error}; the direct beam cannot be measured") from error
        if row.flags & SATURATED:
            raise InstrumentError(
                f"the direct beam saturates the spectrometer at {row.integration_time:g} s;"
                " put a filter into the beam or allow a shorter_time in the plan"
            )
        if self.base_power is None:
            self.base_power = row.reference_power
        self.direct = Freshness(self.store.append(row))

    def _check_point(self) -> None:
        """Measure the last committed point again, to see whether the rig stands where it stood."""
        last = self.store.last
        assert last is not None
        try:
            row = self._record(
                CHECK, last.point, last.axes, last.integration_time, last.direct, may_grow=False
            )
        except LimitReachedError as error:
            raise StalledError(f"{error}; the check point cannot be measured") from error
        place = self.store.append(row)
        before = self._signal(last, self.store.dark_of(last))
        again = self._signal(row, self.store.dark_of(row))
        # Where there is hardly any light, a few counts are no reason to stop.
        floor = 20.0 * np.sqrt(len(last.counts[self.window]))
        scale = max(abs(before), floor / last.integration_time / last.reference_power)
        off = abs(again - before) / scale
        self.log.add("rig", "check point", f"point {last.point}: {off:.2%} off (row {place})")
        tolerance = self.instruments.rig.recovery.check_tolerance
        if off > tolerance:
            raise OutOfBandError(
                f"check point {last.point} is {off:.1%} off, more than {tolerance:.1%}:"
                " look whether lamp, sample or stages have moved"
            )

    def _signal(self, row: Row, dark: Row) -> float:
        """Net counts per second and watt of reference, summed over the window."""
        net = row.counts[self.window].astype(np.float64) - dark.counts[self.window]
        return float(net.sum() / row.integration_time / row.reference_power)

    def _record(
        self,
        kind: int,
        point: int,
        target: npt.NDArray[np.float64],
        start: float,
        direct: int,
        may_grow: bool | None = None,
    ) -> Row:
        """Move, expose, make sure of lamp and stages, and see to a fresh dark."""
        positions = self.instruments.stages.move(target.tolist())
        time.sleep(self.instruments.rig.stages.settle)
        before = self._wait_for_lamp()
        self.instruments.spectrometer.set_shutter(True)
        grow = self.is_automatic if may_grow is None else may_grow
        exposure = self._expose(start, grow)
        after = self.instruments.reference.measure_power()
        self._check_band(after)
        self.instruments.stages.check_ready()
        moment = now_text()
        power = (before + after) / 2.0
        dark = self._dark(exposure.seconds, positions)
        flags = SATURATED if exposure.saturated else 0
        return Row(
            kind,
            point,
            moment,
            np.array(positions),
            power,
            exposure.seconds,
            dark,
            direct,
            flags,
            exposure.counts,
        )

    def _expose(self, start: float, may_grow: bool) -> Exposure:
        def saturated(seconds: float) -> None:
            self.log.add("spectrometer", "saturation", f"at {seconds:g} s; repeated with a shorter time")

        self.check()
        return expose(self.instruments.spectrometer, self.times, start, self.window, may_grow, saturated)

    def _dark(self, seconds: float, positions: tuple[float, ...]) -> int:
        """Return the row of a dark spectrum of this integration time that is fresh enough."""
        fresh = self.darks.get(seconds)
        if fresh is None or fresh.used >= self.plan.dark_every:
            spectrometer = self.instruments.spectrometer
            spectrometer.set_shutter(False)
            self.check()
            counts = spectrometer.measure_spectrum()
            spectrometer.set_shutter(True)
            power = self.instruments.reference.measure_power()
            axes = np.array(positions)
            row = Row(DARK, NO_ROW, now_text(), axes, power, seconds, NO_ROW, NO_ROW, 0, counts)
            fresh = self.darks[seconds] = Freshness(self.store.append(row))
        fresh.used += 1
        return fresh.row

    def _wait_for_lamp(self) -> float:
        """Measure the reference power; outside its band, wait until it is back.

        Raises
        ------
        OutOfBandError
            It does not come back in the time the rig file gives it.
        """
        settings = self.instruments.rig.reference
        deadline = time.monotonic() + settings.wait
        while True:
            power = self.instruments.reference.measure_power()
            try:
                self._check_band(power)
            except OutOfBandError:
                if time.monotonic() > deadline:
                    raise
                self.check()
                time.sleep(settings.every)
            else:
                return power

    def _check_band(self, power: float) -> None:
        band = self.instruments.rig.reference.band
        if self.base_power is not None and abs(power / self.base_power - 1.0) > band:
            text = f"{power:.4g} W, more than {band:.1%} from the {self.base_power:.4g} W at the start"
            self.log.add("reference", "lamp out of band", text)
            raise OutOfBandError(f"reference: the lamp gives {text}; see to the lamp")
