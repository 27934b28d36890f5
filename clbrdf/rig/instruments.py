"""The instruments of a rig together: connect, recover, make safe."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

from clbrdf.rig.drivers import get_driver
from clbrdf.rig.errors import InstrumentError, LimitReachedError, NotReferencedError, StalledError
from clbrdf.rig.eventlog import EventLog
from clbrdf.rig.motion import Stages, make_stages
from clbrdf.rig.rigfile import Rig
from clbrdf.rig.roles import Motion, ReferenceDetector, Spectrometer
from clbrdf.rig.transport import Line

REPLUG_POLL = 0.05


@dataclass(frozen=True)
class Instruments:
    """Three lines and what hangs on them.

    Attributes
    ----------
    rig : Rig
    stages : Stages
    spectrometer : Spectrometer
    reference : ReferenceDetector
    lines : tuple of Line
        In the same order.
    check : callable
        Raises `StoppedError` where the user wants to stop.
    """

    rig: Rig
    stages: Stages
    spectrometer: Spectrometer
    reference: ReferenceDetector
    lines: tuple[Line, Line, Line]
    check: Callable[[], None]

    def _parts(self) -> list[tuple[Line, Stages | Spectrometer | ReferenceDetector]]:
        return list(zip(self.lines, (self.stages, self.spectrometer, self.reference), strict=True))

    def connect(self) -> str:
        """Open and identify all three before anything moves; return what they are.

        Raises
        ------
        InstrumentError
            A port does not exist, is busy, or belongs to another instrument.
        """
        for line in self.lines:
            line.open()
            line.drain()
        return "; ".join(f"{line.name}: {part.identify()}" for line, part in self._parts())

    def home(self) -> None:
        """Home the stages and make the settings of the other two."""
        self.stages.home()
        self.spectrometer.forget()
        self.configure_reference()

    def configure_reference(self) -> None:
        """Set the reference detector's units and wavelength."""
        self.reference.configure(self.rig.reference.wavelength, self.rig.reference.noise)

    def calls_for_homing(self, error: InstrumentError) -> bool:
        """Say whether the stages' positions are no longer to be trusted after an error."""
        lost = NotReferencedError | StalledError | LimitReachedError
        return isinstance(error, lost) or not self.lines[0].is_open

    def recover(self, must_home: bool) -> bool:
        """Bring everything back to a known state; True where the stages were homed.

        Raises
        ------
        InstrumentError
            It does not come back.
        """
        for line, part in self._parts():
            if not line.is_open:
                self._reopen(line)
            line.drain()
            part.identify()
        self.spectrometer.forget()
        self.configure_reference()
        ready = all(stage.get_status().motion is Motion.READY for stage in self.stages.stages)
        if must_home or not ready:
            self.stages.home()
            return True
        return False

    def _reopen(self, line: Line) -> None:
        deadline = time.monotonic() + self.rig.recovery.replug_time
        while True:
            try:
                line.open()
                line.drain()
            except InstrumentError:
                if time.monotonic() > deadline:
                    raise
                self.check()
                time.sleep(REPLUG_POLL)
            else:
                line.fault("replugged", f"{line.port} is open again; nothing about its instrument is assumed")
                return

    def make_safe(self) -> None:
        """Stop the stages and close the shutter, as far as they listen; never raises."""
        with suppress(InstrumentError):
            self.stages.stop()
        with suppress(InstrumentError):
            self.spectrometer.set_shutter(False)

    def close(self) -> None:
        """Close the ports."""
        for line in self.lines:
            line.close()


def make_instruments(rig: Rig, log: EventLog, check: Callable[[], None]) -> Instruments:
    """Return the instruments of a rig file, not yet connected.

    Raises
    ------
    InputError
        The file names a driver that does not exist.
    """
    lines = tuple(
        Line(name, part.port, part.baud, part.patience, part.reply_time, log)
        for name, part in (
            ("stages", rig.stages),
            ("spectrometer", rig.spectrometer),
            ("reference", rig.reference),
        )
    )
    stages = make_stages(lines[0], rig.stages, get_driver("stages", rig.stages.driver), check)
    spectrometer = get_driver("spectrometer", rig.spectrometer.driver)(lines[1])
    reference = get_driver("reference", rig.reference.driver)(lines[2])
    return Instruments(rig, stages, spectrometer, reference, (lines[0], lines[1], lines[2]), check)
