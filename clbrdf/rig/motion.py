"""The three stages together: home them, move them, and believe nothing that was not read back.

"Not moving" is not "arrived": a stage is done when it reports ready, two readings of its position agree,
and that is the target within the tolerance. A status reply that was lost may have told of a stall and
will not tell it again: the stages are homed then.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from clbrdf.rig.connection import Context
from clbrdf.rig.drivers import get_driver
from clbrdf.rig.errors import (
    InstrumentError,
    LimitReachedError,
    LineError,
    NotReferencedError,
    StalledError,
    UnmendedError,
)
from clbrdf.rig.eventlog import EventLog
from clbrdf.rig.roles import Motion, Stage, StageGroup, StageStatus
from clbrdf.rig.stagesettings import AXES, StageSettings, StagesSettings
from clbrdf.rig.zones import find_legs

MARGIN = 2.0
"""A move may take this many times its own time, plus a second, before it counts as stalled."""

NAME = "stages"


@dataclass(frozen=True)
class Stages:
    """The axes lamp, turn and pitch, on one connection or several.

    Attributes
    ----------
    groups : sequence of StageGroup
        One for each driver.
    stages : mapping of str to Stage
        By the name of the axis.
    settings : StagesSettings
        From the rig file.
    log : EventLog
    check : callable
        Called between exchanges; raises `StoppedError` where the user wants to stop.
    """

    groups: Sequence[StageGroup]
    stages: Mapping[str, Stage]
    settings: StagesSettings
    log: EventLog
    check: Callable[[], None]

    @property
    def is_open(self) -> bool:
        """False before `open`, and after a connection was lost."""
        return all(group.is_open for group in self.groups)

    def open(self) -> None:
        """Connect whatever is not connected."""
        for group in self.groups:
            if not group.is_open:
                group.open()

    def close(self) -> None:
        """Disconnect."""
        for group in self.groups:
            group.close()

    def identify(self) -> str:
        """Get what every stage is; raise InstrumentError where another instrument answers."""
        return "; ".join(group.identify() for group in self.groups)

    def is_ready(self) -> bool:
        """Say whether all stages stand referenced and ready, with nothing left to doubt."""
        statuses = [self.stages[name].get_status() for name in AXES]
        return all(s.motion is Motion.READY and not s.doubtful and not s.stalled for s in statuses)

    def home(self) -> None:
        """Bring the stages to their home positions, one after the other, and set limits and speed.

        The order is that of `homing_order` in the rig file; whatever state a stage is in is left first.

        Raises
        ------
        NotReferencedError
            A stage did not reach its home in time.
        """
        self.stop()
        for name in self.settings.homing_order:
            stage, settings = self.stages[name], self._of(name)
            self._make_unreferenced(name, stage)
            stage.start_homing()
            began = time.monotonic()
            deadline = began + self.settings.homing_time
            while (status := stage.get_status()).motion is not Motion.READY:
                now = time.monotonic()
                if now > deadline or (status.motion is not Motion.HOMING and now > began + 2.0):
                    self.log.add(NAME, "not referenced", f"{name} did not home: {_words(status)}")
                    raise NotReferencedError(
                        f"{NAME}: {name} does not home in {self.settings.homing_time:g} s"
                        f" ({_words(status)}); free its way, or allow a longer homing_time"
                    )
                self._wait()
            stage.configure(settings.raw_limits, settings.velocity, settings.acceleration)

    def _make_unreferenced(self, name: str, stage: Stage) -> None:
        deadline = time.monotonic() + self.settings.reset_time
        words = "no reply"
        while True:
            try:
                if stage.is_unreferenced():
                    return
                words = _words(stage.get_status())
            except LineError:
                # A controller that leaves configuration is silent for up to 10 s.
                if time.monotonic() > deadline:
                    raise
            if time.monotonic() > deadline:
                raise NotReferencedError(f"{NAME}: {name} does not reset ({words})")
            self._wait()

    def move(self, targets: Sequence[float]) -> tuple[float, ...]:
        """Move to rig angles (lamp, turn, pitch) in degrees, around collision zones; return those read back.

        Raises
        ------
        UnmendedError
            No way around the collision zones is known.
        LimitReachedError
            A limit switch was hit; everything has been stopped.
        NotReferencedError, StalledError
            A stage lost its reference, stopped on its way, or took too long.
        """
        zones = self.settings.boxes
        positions: tuple[float, ...] = ()
        legs: list[tuple[float, ...]] | None = [tuple(targets)]
        if zones:
            between = [(0.0, 0.0, 0.0), *([self.settings.park] if self.settings.park else [])]
            legs = find_legs(self.positions(), tuple(targets), zones, between)
        if legs is None:
            raise UnmendedError(
                f"{NAME}: no way from {_degrees(self.positions())} to {_degrees(targets)} around the"
                " collision zones; set stages.park to a pose from which both can be reached"
            )
        for leg in legs:
            positions = self._move(leg)
        return positions

    def _move(self, targets: Sequence[float]) -> tuple[float, ...]:
        for _ in range(3):
            allowed = 0.0
            for name, target in zip(AXES, targets, strict=True):
                stage, settings = self.stages[name], self._of(name)
                raw = settings.to_raw(target)
                distance = abs(raw - stage.get_position(self.settings.tolerance))
                # Where it stands within half the tolerance nothing would move but the servo.
                if distance <= self.settings.tolerance / 2.0:
                    continue
                allowed = max(allowed, settings.travel_time(distance))
                stage.start_move(raw)
            deadline = time.monotonic() + MARGIN * allowed + 1.0 + self.settings.move_time
            for name in AXES:
                while self._checked(name).motion is not Motion.READY:
                    if time.monotonic() > deadline:
                        self.log.add(
                            NAME, "stall", f"{name} takes longer than {MARGIN * allowed + 1.0:.3g} s"
                        )
                        raise StalledError(
                            f"{NAME}: {name} did not arrive in time; see whether it moves freely, and to"
                            " its velocity and acceleration in the rig file"
                        )
                    self._wait()
            positions = self.positions()
            off = max(abs(p - t) for p, t in zip(positions, targets, strict=True))
            if off <= self.settings.tolerance:
                return positions
            # The command was damaged on its way: an absolute move may be sent again.
            self.log.add(NAME, "wrong position", f"at {_degrees(positions)}, sent to {_degrees(targets)}")
        raise StalledError(
            f"{NAME}: the stages stop at {_degrees(positions)}, not {_degrees(targets)}; if they hunt around"
            f" it, raise stages.tolerance (now {self.settings.tolerance:g}°)"
        )

    def positions(self) -> tuple[float, ...]:
        """Measure the rig angles (lamp, turn, pitch) in degrees, each the mean of two that agree."""
        tolerance = self.settings.tolerance
        return tuple(self._of(n).from_raw(self.stages[n].get_position(tolerance)) for n in AXES)

    def check_ready(self) -> None:
        """Raise NotReferencedError, StalledError or LimitReachedError where a stage does not stand ready."""
        for name in AXES:
            if self._checked(name).motion is not Motion.READY:
                self.log.add(NAME, "stall", f"{name} moved during the measurement")
                raise StalledError(f"{NAME}: {name} is not at rest")

    def park(self) -> None:
        """Move to the park position, where the rig file gives one."""
        if self.settings.park is not None:
            self.move(self.settings.park)

    def stop(self) -> None:
        """Stop all stages."""
        for group in self.groups:
            group.stop()

    def _checked(self, name: str) -> StageStatus:
        status = self.stages[name].get_status()
        if status.limit:
            self.stop()
            self.log.add(NAME, "limit switch", f"{name}: {_words(status)}")
            raise LimitReachedError(f"{NAME}: {name} ran into a limit switch ({_words(status)})")
        if status.motion in (Motion.NOT_REFERENCED, Motion.HOMING, Motion.CONFIGURATION):
            self.log.add(NAME, "homing lost", f"{name}: {_words(status)}")
            raise NotReferencedError(f"{NAME}: {name} has lost its reference ({_words(status)})")
        if status.stalled or status.motion is Motion.DISABLED:
            self.stop()
            self.log.add(NAME, "stall", f"{name}: {_words(status)}")
            raise StalledError(f"{NAME}: {name} stopped on its way ({_words(status)})")
        if status.doubtful:
            self.log.add(NAME, "status in doubt", f"{name}: a reply was lost, perhaps with an error bit")
            raise StalledError(
                f"{NAME}: a status reply of {name} was lost, and an error bit may be lost with it"
            )
        return status

    def _of(self, name: str) -> StageSettings:
        settings = getattr(self.settings, name)
        assert isinstance(settings, StageSettings)
        return settings

    def _wait(self) -> None:
        self.check()
        time.sleep(self.settings.poll)


def _words(status: StageStatus) -> str:
    return ", ".join((status.motion.value, *status.errors))


def _degrees(angles: Sequence[float]) -> str:
    return "(" + ", ".join(f"{a:g}" for a in angles) + ")°"


def make_stages(settings: StagesSettings, context: Context, check: Callable[[], None]) -> Stages:
    """Return the three stages of a rig file, not yet connected; axes of one driver share a connection."""
    groups: list[StageGroup] = []
    stages: dict[str, Stage] = {}
    for driver in dict.fromkeys(settings.driver_of(name) for name in AXES):
        names = [name for name in AXES if settings.driver_of(name) == driver]
        axes = {name: getattr(settings, name) for name in names}
        try:
            group: StageGroup = get_driver("stages", driver).connect(settings, axes, context)
        except InstrumentError as error:
            raise InstrumentError(f"{NAME}: {error}") from error
        groups.append(group)
        stages |= group.stages
    return Stages(groups, stages, settings, context.log, check)
