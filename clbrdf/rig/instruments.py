"""The instruments of a rig together: connect, recover, make safe."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from clbrdf.rig.connection import Context, nobody
from clbrdf.rig.drivers import get_driver
from clbrdf.rig.errors import InstrumentError, LimitReachedError, NotReferencedError, StalledError
from clbrdf.rig.eventlog import EventLog
from clbrdf.rig.motion import Stages, make_stages
from clbrdf.rig.rigfile import Rig
from clbrdf.rig.roles import ReferenceDetector, Spectrometer

Part = Stages | Spectrometer | ReferenceDetector

REPLUG_POLL = 0.05

SAFE_TIME = 2.0
"""How long an instrument that was lost at the very end is waited for, s."""


@dataclass(frozen=True)
class Instruments:
    """Stages, spectrometer and reference detector.

    Attributes
    ----------
    rig : Rig
    stages : Stages
    spectrometer : Spectrometer
    reference : ReferenceDetector
    log : EventLog
    check : callable
        Raises `StoppedError` where the user wants to stop.
    """

    rig: Rig
    stages: Stages
    spectrometer: Spectrometer
    reference: ReferenceDetector
    log: EventLog
    check: Callable[[], None]

    def _parts(self) -> list[tuple[str, Part]]:
        return [
            ("stages", self.stages),
            ("spectrometer", self.spectrometer),
            ("reference", self.reference),
        ]

    def connect(self) -> str:
        """Open and identify all three before anything moves; return what they are.

        Raises
        ------
        InstrumentError
            An instrument does not exist, is busy, or is another one.
        """
        for _, part in self._parts():
            part.open()
        return "; ".join(f"{name}: {part.identify()}" for name, part in self._parts())

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
        return isinstance(error, lost) or not self.stages.is_open

    def recover(self, must_home: bool) -> bool:
        """Bring everything back to a known state; True where the stages were homed.

        Raises
        ------
        InstrumentError
            It does not come back.
        """
        for name, part in self._parts():
            self._find_again(name, part, self.rig.recovery.replug_time, self.check)
        self.spectrometer.forget()
        self.configure_reference()
        if must_home or not self.stages.is_ready():
            self.stages.home()
            return True
        return False

    def _find_again(self, name: str, part: Part, longest: float, check: Callable[[], None]) -> None:
        if not part.is_open:
            self._reopen(name, part, longest, check)
        part.identify()

    def _reopen(self, name: str, part: Part, longest: float, check: Callable[[], None]) -> None:
        deadline = time.monotonic() + longest
        while True:
            try:
                part.open()
            except InstrumentError:
                if time.monotonic() > deadline:
                    raise
                check()
                time.sleep(REPLUG_POLL)
            else:
                self.log.add(name, "replugged", "connected again; nothing about the instrument is assumed")
                return

    def make_safe(self) -> None:
        """Stop the stages and close the shutter, and say in the log what did not listen.

        Raises nothing of its own. A KeyboardInterrupt meanwhile comes out when all is safe.
        """
        try:
            self._make_safe()
        except KeyboardInterrupt:
            self._make_safe()
            raise

    def _make_safe(self) -> None:
        self._insist("stages", self.stages, "stop the stages", self.stages.stop)
        self._insist("spectrometer", self.spectrometer, "close the shutter", self._close_shutter)
        # Asked last, for it takes longest: a command to stop has no reply.
        self._insist("stages", self.stages, "stop the stages", self._stop)

    def _stop(self) -> None:
        self.stages.stop()
        self.stages.is_ready()  # that they answer tells that they were there to hear it

    def _close_shutter(self) -> None:
        self.spectrometer.forget()
        self.spectrometer.set_shutter(False)

    def _insist(self, name: str, part: Part, what: str, action: Callable[[], None]) -> None:
        """Do something again where an instrument was lost meanwhile, and say where it cannot be done."""
        if not part.is_open:  # the error that ends the run tells of it
            return
        try:
            try:
                action()
            except InstrumentError:
                # Who asked to stop wants this, too: no check ends it.
                self._find_again(name, part, SAFE_TIME, lambda: None)
                action()
        except InstrumentError as error:
            self.log.add(name, "not safe", f"could not {what}: {error}; see to it by hand")

    def close(self) -> None:
        """Disconnect."""
        for _, part in self._parts():
            part.close()


def make_instruments(
    rig: Rig, log: EventLog, check: Callable[[], None], ask: Callable[[str], str] = nobody
) -> Instruments:
    """Return the instruments of a rig file, not yet connected.

    Parameters
    ----------
    rig : Rig
    log : EventLog
    check : callable
        Called between exchanges; raises `StoppedError` where the user wants to stop.
    ask : callable
        Puts a question to a person and returns the answer.

    Raises
    ------
    InputError
        The file names a driver that does not exist.
    InstrumentError
        A driver needs an extra that is not installed.
    """
    stages = make_stages(rig.stages, Context("stages", log, ask), check)
    spectrometer = get_driver("spectrometer", rig.spectrometer.driver).connect(
        rig.spectrometer, Context("spectrometer", log, ask)
    )
    reference = get_driver("reference", rig.reference.driver).connect(
        rig.reference, Context("reference", log, ask)
    )
    return Instruments(rig, stages, spectrometer, reference, log, check)
