"""Emulated STS spectrometer speaking OBP; its lamp-enable output drives the shutter."""

from __future__ import annotations

import struct

import numpy as np
import numpy.typing as npt

from clbrdf.rig.drivers import obp_message as obp
from clbrdf.rig.drivers.obp import ObpSpectrometer
from clbrdf.rig.emulator.world import WAVELENGTH_COEFFICIENTS, World

SERIAL_NUMBER = b"S12345"
DEFAULT_TIME = 0.01
"""Integration time after power-on, s."""


class EmulatedSpectrometer:
    """The spectrometer as a device of the emulator."""

    name = "spectrometer"

    def __init__(self, world: World) -> None:
        self.world = world
        self.nonlinearity = list(world.settings.effects.nonlinearity)
        self.flash = False
        self._was_reset = False
        self._defaults()

    def _defaults(self) -> None:
        self.seconds = DEFAULT_TIME
        self.seconds_before: float | None = None
        self.shutter = False
        self.trigger_mode = 0

    def take(self, buffer: bytearray) -> bytes | None:
        """Remove the first whole message and the garbage before it; a broken one is refused."""
        found = obp.find_message(buffer)
        message = found.message
        data = bytes(buffer[: found.used])
        del buffer[: found.used]
        return None if message is None else data[len(found.garbage) :]

    def text(self, request: bytes) -> str:
        """Return the message type in hexadecimal."""
        return f"{struct.unpack_from('<I', request, 8)[0]:08X}" if len(request) >= 12 else ""

    def answer(self, request: bytes) -> bytes:
        """Obey one message."""
        message = obp.find_message(request).message
        if message is None:
            return b""
        if self._was_reset:
            self._was_reset = False
            return self._reply(message, error=obp.ERROR_RESET)
        data, error = self._obey(message)
        if error:
            return self._reply(message, error=error)
        if data is None:
            return self._reply(message, flags=obp.ACK) if message.flags & obp.ACK_REQUESTED else b""
        return self._reply(message, data)

    def _reply(self, to: obp.Message, data: bytes = b"", flags: int = 0, error: int = 0) -> bytes:
        flags |= obp.RESPONSE | (obp.NACK if error else 0)
        return obp.Message(to.kind, to.regarding, data, flags, error, to.version, to.checksum).encode()

    def _obey(self, message: obp.Message) -> tuple[bytes | None, int]:
        """Return the reply's data (None: only an acknowledgement) and the error number."""
        kind, data = message.kind, message.data
        tables = {
            obp.GET_WAVELENGTH_COEFFICIENT: list(WAVELENGTH_COEFFICIENTS),
            obp.GET_NONLINEARITY_COEFFICIENT: self.nonlinearity,
        }
        counts = {
            obp.GET_WAVELENGTH_COEFFICIENT_COUNT: len(WAVELENGTH_COEFFICIENTS),
            obp.GET_NONLINEARITY_COEFFICIENT_COUNT: len(self.nonlinearity),
        }
        constants = {
            obp.GET_HARDWARE_VERSION: b"\x03",
            obp.GET_FIRMWARE_VERSION: b"\x36\x00",
            obp.GET_SERIAL_NUMBER: SERIAL_NUMBER,
        }
        if kind in constants:
            return constants[kind], 0
        if kind in counts:
            return bytes([counts[kind]]), 0
        if kind in tables:
            if len(data) != 1 or data[0] >= len(tables[kind]):
                return None, 6
            return struct.pack("<f", tables[kind][data[0]]), 0
        if kind in (obp.GET_RAW_SPECTRUM, obp.GET_CORRECTED_SPECTRUM):
            return self._expose().astype("<u2").tobytes(), 0
        return self._set(kind, data)

    def _set(self, kind: int, data: bytes) -> tuple[bytes | None, int]:
        if kind == obp.RESET:
            self._defaults()
        elif kind == obp.GET_TRIGGER_MODE:
            return bytes([self.trigger_mode]), 0
        elif kind == obp.SET_INTEGRATION_TIME:
            if len(data) != 4:
                return None, 5
            seconds = struct.unpack("<I", data)[0] / 1e6
            if not ObpSpectrometer.shortest <= seconds <= ObpSpectrometer.longest:
                return None, 6
            if seconds != self.seconds:
                self.seconds_before, self.seconds = self.seconds, seconds
        elif kind in (obp.SET_TRIGGER_MODE, obp.SET_LAMP_ENABLE):
            if len(data) != 1:
                return None, 5
            if kind == obp.SET_LAMP_ENABLE:
                self.shutter = bool(data[0])
            else:
                self.trigger_mode = data[0]
        else:
            return None, 2
        return None, 0

    def _expose(self) -> npt.NDArray[np.uint16]:
        """Integrate; the first spectrum after a change of time is still taken with the old one."""
        before, self.seconds_before = self.seconds_before, None
        seconds = self.seconds if before is None else before
        self.world.clock.sleep(seconds)
        if self.flash:
            self.flash = False
            return np.full(ObpSpectrometer.pixels, ObpSpectrometer.full_scale, np.uint16)
        return self.world.counts(seconds, self.shutter)

    def power_cut(self) -> bytes:
        """Start again; the next reply says so."""
        self._defaults()
        self._was_reset = True
        return b""

    def happens(self, fault: str, request: bytes) -> bool:
        """Flash where it shows: in a spectrum with the shutter open that is not the first after a change."""
        shows = (
            self.text(request) == f"{obp.GET_RAW_SPECTRUM:08X}"
            and self.seconds_before is None
            and self.shutter
            and not self._was_reset
        )
        if fault == "saturation" and shows:
            self.flash = True
        return shows
