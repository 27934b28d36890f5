"""The three stages together: home them, move them, and believe nothing that was not read back.

"Not moving" is not "arrived": a stage is done when it reports ready, its position was read twice with
the same result, and that is the target within the tolerance.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from clbrdf.rig.errors import LimitReachedError, LineError, NotReferencedError, StalledError
from clbrdf.rig.rigfile import AXES, StageSettings, StagesSettings
from clbrdf.rig.roles import Motion, Stage, StageStatus
from clbrdf.rig.transport import Line

MARGIN = 2.0
"""A move may take this many times its predicted time, plus a second, before it counts as stalled."""


@dataclass(frozen=True)
class Stages:
    """Stages in the order lamp, turn, pitch, on one line.

    Attributes
    ----------
    line : Line
    stages : sequence of Stage
    settings : StagesSettings
        From the rig file.
    check : callable
        Called between exchanges; raises `StoppedError` where the user wants to stop.
    """

    line: Line
    stages: Sequence[Stage]
    settings: StagesSettings
    check: Callable[[], None]

    def identify(self) -> str:
        """Get the firmware of every stage; raise InstrumentError where another instrument answers."""
        return "; ".join(stage.identify() for stage in self.stages)

    def home(self) -> None:
        """Bring every stage to its home position, whatever state it is in, and set its limits and speed.

        Raises
        ------
        NotReferencedError
            A stage did not reach its home in time.
        """
        self.stages[0].stop()
        for name, stage in zip(AXES, self.stages, strict=True):
            self._make_unreferenced(name, stage)
        for stage in self.stages:
            stage.start_homing()
        for name, stage in zip(AXES, self.stages, strict=True):
            began = time.monotonic()
            deadline = began + self.settings.homing_time + self.line.patience
            while (status := stage.get_status()).motion is not Motion.READY:
                idle = status.motion is not Motion.HOMING
                if time.monotonic() > deadline or (idle and time.monotonic() > began + self.line.patience):
                    self.line.fault("not referenced", f"{name} did not home: {_words(status)}")
                    raise NotReferencedError(f"{self.line.name}: {name} does not home ({_words(status)})")
                self._wait()
            settings = self._of(name)
            stage.configure(settings.raw_limits, settings.velocity, settings.acceleration)

    def _make_unreferenced(self, name: str, stage: Stage) -> None:
        """Reset a stage: homing starts only from "not referenced"."""
        deadline = time.monotonic() + self.settings.reset_time + self.line.patience
        status = stage.get_status()
        if status.motion is Motion.CONFIGURATION:
            stage.leave_configuration()
        elif status.motion is not Motion.NOT_REFERENCED:
            stage.reset()
        while True:
            try:
                status = stage.get_status()
            except LineError:
                # A controller that leaves configuration is silent for up to 10 s.
                if time.monotonic() > deadline:
                    raise
            if status.motion is Motion.NOT_REFERENCED:
                return
            if time.monotonic() > deadline:
                raise NotReferencedError(f"{self.line.name}: {name} does not reset ({_words(status)})")
            self._wait()

    def move(self, targets: Sequence[float]) -> tuple[float, ...]:
        """Move to rig angles (lamp, turn, pitch) in degrees; return those read back.

        Raises
        ------
        LimitReachedError
            A limit switch was hit; everything has been stopped.
        NotReferencedError, StalledError
            A stage lost its reference, stopped on its way, or took too long.
        """
        for _ in range(3):
            allowed = 0.0
            for name, stage, target in zip(AXES, self.stages, targets, strict=True):
                raw = self._of(name).to_raw(target)
                distance = abs(raw - stage.get_position())
                if distance == 0.0:
                    continue
                # A digit lost on the line could make this far too long or too short.
                own = self._of(name).travel_time(distance)
                allowed = max(allowed, own, min(stage.get_predicted_time(distance), 3.0 * own + 1.0))
                stage.start_move(raw)
            deadline = time.monotonic() + MARGIN * allowed + 1.0 + self.line.patience
            for name, stage in zip(AXES, self.stages, strict=True):
                while self._checked(name, stage).motion is not Motion.READY:
                    if time.monotonic() > deadline:
                        self.line.fault("stall", f"{name} takes longer than {MARGIN * allowed + 1.0:.3g} s")
                        raise StalledError(f"{self.line.name}: {name} did not arrive in time")
                    self._wait()
            positions = self.positions()
            off = max(abs(p - t) for p, t in zip(positions, targets, strict=True))
            if off <= self.settings.tolerance:
                return positions
            # The command was damaged on its way: an absolute move may be sent again.
            self.line.fault("wrong position", f"at {_degrees(positions)}, sent to {_degrees(targets)}")
        raise StalledError(
            f"{self.line.name}: the stages stop at {_degrees(positions)}, not {_degrees(targets)}"
        )

    def positions(self) -> tuple[float, ...]:
        """Measure the rig angles (lamp, turn, pitch) in degrees, each read twice with the same result."""
        pairs = zip(AXES, self.stages, strict=True)
        return tuple(self._of(name).from_raw(stage.get_position()) for name, stage in pairs)

    def check_ready(self) -> None:
        """Raise NotReferencedError, StalledError or LimitReachedError where a stage does not stand ready."""
        for name, stage in zip(AXES, self.stages, strict=True):
            if self._checked(name, stage).motion is not Motion.READY:
                self.line.fault("stall", f"{name} moved during the measurement")
                raise StalledError(f"{self.line.name}: {name} is not at rest")

    def stop(self) -> None:
        """Stop all stages."""
        self.stages[0].stop()

    def _checked(self, name: str, stage: Stage) -> StageStatus:
        status = stage.get_status()
        if status.limit:
            self.stop()
            self.line.fault("limit switch", f"{name}: {_words(status)}")
            raise LimitReachedError(f"{self.line.name}: {name} ran into a limit switch ({_words(status)})")
        if status.motion in (Motion.NOT_REFERENCED, Motion.HOMING, Motion.CONFIGURATION):
            self.line.fault("homing lost", f"{name}: {_words(status)}")
            raise NotReferencedError(f"{self.line.name}: {name} has lost its reference ({_words(status)})")
        if status.stalled or status.motion is Motion.DISABLED:
            self.stop()
            self.line.fault("stall", f"{name}: {_words(status)}")
            raise StalledError(f"{self.line.name}: {name} stopped on its way ({_words(status)})")
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


def make_stages(line: Line, settings: StagesSettings, driver: type, check: Callable[[], None]) -> Stages:
    """Return the three stages of a rig file on an open line."""
    parts = [driver(line, getattr(settings, name).address) for name in AXES]
    return Stages(line, parts, settings, check)
