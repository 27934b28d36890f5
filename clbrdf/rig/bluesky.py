"""Our rig for bluesky: three movable axes, a spectrometer to trigger and read, a reference power.

The classes follow bluesky's protocols (`Movable`, `Readable`, `Triggerable`, `Stoppable`) without needing
bluesky to be installed; the extra `bluesky` brings a RunEngine to drive them. Moves and exposures run in
threads, one at a time, because the instruments share lines.

Source: bluesky, "Protocols" (`bluesky.protocols`), and event-model, "Data keys".
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from clbrdf.rig.connection import nobody
from clbrdf.rig.eventlog import EventLog
from clbrdf.rig.instruments import Instruments, make_instruments
from clbrdf.rig.lightmeter import LightMeter, PoseLight
from clbrdf.rig.rigfile import Rig
from clbrdf.rig.stagesettings import AXES

SOURCE = "clbrdf"


class RigStatus:
    """What a move or an exposure came to; the `Status` of bluesky's protocols."""

    def __init__(self, action: Callable[[], None]) -> None:
        self._done = threading.Event()
        self._error: BaseException | None = None
        self._callbacks: list[Callable[[RigStatus], None]] = []
        self._lock = threading.Lock()
        threading.Thread(target=self._run, args=(action,), daemon=True).start()

    def _run(self, action: Callable[[], None]) -> None:
        try:
            action()
        except BaseException as error:  # handed to whoever waits
            self._error = error
        with self._lock:
            self._done.set()
            callbacks, self._callbacks = self._callbacks, []
        for callback in callbacks:
            callback(self)

    @property
    def done(self) -> bool:
        """Whether it is over."""
        return self._done.is_set()

    @property
    def success(self) -> bool:
        """Whether it is over and went well."""
        return self.done and self._error is None

    def exception(self, timeout: float | None = 0.0) -> BaseException | None:
        """Return the error, None where there was none; wait up to `timeout` s, for ever if None."""
        if not self._done.wait(timeout):
            raise TimeoutError("not over yet")
        return self._error

    def add_callback(self, callback: Callable[[Any], None]) -> None:
        """Call with this status once it is over, at once if it is."""
        with self._lock:
            if not self._done.is_set():
                self._callbacks.append(callback)
                return
        callback(self)


@dataclass
class _Shared:
    """What the devices share: one exchange at a time, and the pose that was asked for."""

    instruments: Instruments
    meter: LightMeter
    lock: threading.RLock
    pose: list[float]


class RigAxis:
    """One axis: `Movable`, `Readable`, `Stoppable`; degrees."""

    parent = None

    def __init__(self, name: str, place: int, shared: _Shared) -> None:
        self.name = name
        self._place = place
        self._shared = shared

    def set(self, value: float) -> RigStatus:
        """Move to a rig angle in degrees."""
        low, high = getattr(self._shared.instruments.rig.stages, AXES[self._place]).limits
        if not low <= value <= high:
            raise ValueError(f"{self.name}: {value:g}° is outside [{low:g}, {high:g}]°")

        def move() -> None:
            with self._shared.lock:
                self._shared.pose[self._place] = float(value)
                self._shared.instruments.stages.move(self._shared.pose)

        return RigStatus(move)

    def stop(self, *, success: bool = False) -> None:
        """Stop all axes."""
        del success
        self._shared.instruments.stages.stop()

    def read(self) -> dict[str, dict[str, Any]]:
        """Read the angle back, degrees."""
        with self._shared.lock:
            angle = self._shared.instruments.stages.positions()[self._place]
        return {self.name: {"value": angle, "timestamp": time.time()}}

    def describe(self) -> dict[str, dict[str, Any]]:
        """Describe what `read` gives."""
        return {self.name: {"source": SOURCE, "dtype": "number", "shape": [], "units": "deg"}}

    @property
    def hints(self) -> dict[str, list[str]]:
        """What to plot over."""
        return {"fields": [self.name]}


class RigSpectrometer:
    """Net light at the present pose: `Triggerable`, `Readable`.

    Reads `<name>_spectrum`, net counts per second and watt of the reference (one number for each pixel),
    `<name>_sigma`, their standard uncertainties, and `<name>_sum`.
    """

    parent = None

    def __init__(self, name: str, shared: _Shared) -> None:
        self.name = name
        self._shared = shared
        self._light: PoseLight | None = None
        self._moment = 0.0

    def trigger(self) -> RigStatus:
        """Expose, with a fresh dark where one is due."""

        def expose() -> None:
            with self._shared.lock:
                self._light = self._shared.meter.measure(self._shared.pose)
                self._moment = time.time()

        return RigStatus(expose)

    def read(self) -> dict[str, dict[str, Any]]:
        """Return the last exposure."""
        if self._light is None:
            raise RuntimeError(f"{self.name} was read before it was triggered")
        light = self._light
        values = {
            "spectrum": light.spectrum,
            "sigma": light.variance**0.5,
            "sum": light.total()[0],
        }
        return {f"{self.name}_{key}": {"value": v, "timestamp": self._moment} for key, v in values.items()}

    def describe(self) -> dict[str, dict[str, Any]]:
        """Describe what `read` gives."""
        pixels = self._shared.instruments.spectrometer.pixels
        units = {"source": SOURCE, "units": "counts/s/W"}
        array = {**units, "dtype": "array", "shape": [pixels], "dtype_numpy": "<f8"}
        return {
            f"{self.name}_spectrum": array,
            f"{self.name}_sigma": array,
            f"{self.name}_sum": {**units, "dtype": "number", "shape": []},
        }

    @property
    def hints(self) -> dict[str, list[str]]:
        """What to plot."""
        return {"fields": [f"{self.name}_sum"]}


@dataclass(frozen=True)
class RigDevices:
    """The rig as devices of bluesky; connected and homed until `close`."""

    lamp: RigAxis
    turn: RigAxis
    pitch: RigAxis
    spectrometer: RigSpectrometer
    close: Callable[[], None]

    def __enter__(self) -> RigDevices:
        return self

    def __exit__(self, *details: object) -> None:
        self.close()


def connect_devices(rig: Rig, ask: Callable[[str], str] = nobody) -> RigDevices:
    """Connect and home a rig, and return its devices.

    Parameters
    ----------
    rig : Rig
        From `load_rig`.
    ask : callable
        Puts a question to a person, for what is done by hand.

    Raises
    ------
    InstrumentError
        An instrument that cannot be used.
    """
    log = EventLog()

    def unhindered() -> None:
        """Nobody asks to stop: bluesky stops devices itself."""

    instruments = make_instruments(rig, log, unhindered, ask)
    try:
        instruments.connect()
        instruments.home()
    except BaseException:
        instruments.make_safe()
        instruments.close()
        raise
    pose = list(instruments.stages.positions())
    shared = _Shared(instruments, LightMeter(instruments, log, unhindered), threading.RLock(), pose)

    def close() -> None:
        instruments.make_safe()
        instruments.close()

    lamp, turn, pitch = (RigAxis(name, place, shared) for place, name in enumerate(AXES))
    return RigDevices(lamp, turn, pitch, RigSpectrometer("spectrometer", shared), close)
