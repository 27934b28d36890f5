"""Emulated STS spectrometer speaking OBP; its lamp-enable output drives the shutter.

Written from the data sheet's list of messages, not from our driver: a type that is not in the list is
refused, so is a value out of its range. Trigger mode, averaging and boxcar stay as the last user left
them; with a trigger mode other than 0 a spectrum waits for a trigger that never comes.
"""

from __future__ import annotations

import struct

import numpy as np
import numpy.typing as npt

from clbrdf.rig.emulator import obp_wire
from clbrdf.rig.emulator.settings import LeftSettings
from clbrdf.rig.emulator.world import FULL_SCALE, PIXELS, WAVELENGTH_COEFFICIENTS, World

SERIAL_NUMBER = b"S12345"
DEFAULT_TIME = 0.01
"""Integration time after power-on, s."""

SHORTEST, LONGEST = 10e-6, 85.0
TEMPERATURE = 31.5
"""Of the detector, °C."""

RESPONSE, ACK, NACK = 1, 2, 8
BAD_TYPE, BAD_LENGTH, BAD_VALUE, WAS_RESET = 2, 5, 6, 9
RESET, SERIAL, HARDWARE, FIRMWARE = 0x00000001, 0x00000100, 0x00000080, 0x00000090
SERIAL_LENGTH = 0x00000101
CORRECTED, RAW = 0x00101000, 0x00101100
SET_TIME, GET_TRIGGER, SET_TRIGGER, LAMP = 0x00110010, 0x00110100, 0x00110110, 0x00110410
GET_AVERAGE, SET_AVERAGE, GET_BOXCAR, SET_BOXCAR = 0x00120000, 0x00120010, 0x00121000, 0x00121010
WAVELENGTH_COUNT, WAVELENGTH = 0x00180100, 0x00180101
NONLINEARITY_COUNT, NONLINEARITY = 0x00181100, 0x00181101
GET_TEMPERATURE = 0x00400001


class EmulatedSpectrometer:
    """The spectrometer as a device of the emulator."""

    name = "spectrometer"

    def __init__(self, world: World, left: LeftSettings | None = None) -> None:
        self.world = world
        self.left = left or LeftSettings()
        self.nonlinearity = list(world.settings.effects.nonlinearity)
        self.flash = False
        self._was_reset = False
        self._defaults()

    def _defaults(self) -> None:
        self.seconds = DEFAULT_TIME
        self.seconds_before: float | None = None
        self.world.move_shutter(False)
        self.trigger_mode = self.left.trigger_mode
        self.averages = self.left.averages
        self.boxcar = self.left.boxcar

    @property
    def shutter(self) -> bool:
        """Whether the lamp-enable output is on."""
        return self.world.is_open

    def take(self, buffer: bytearray) -> bytes | None:
        """Remove the first whole frame and the garbage before it."""
        return obp_wire.cut_out(buffer)

    def text(self, request: bytes) -> str:
        """Return the message type in hexadecimal."""
        return f"{struct.unpack_from('<I', request, obp_wire.TYPE_AT)[0]:08X}" if len(request) >= 12 else ""

    def answer(self, request: bytes) -> bytes:
        """Obey one frame; a damaged one is not obeyed."""
        message = obp_wire.read(request)
        if message is None:
            return b""
        if self._was_reset:
            self._was_reset = False
            return obp_wire.write(message, b"", RESPONSE | NACK, WAS_RESET)
        if message.kind in (RAW, CORRECTED) and self.trigger_mode != 0:
            return b""
        data, error = self._obey(message.kind, message.data)
        if error:
            return obp_wire.write(message, b"", RESPONSE | NACK, error)
        if data is None:
            return obp_wire.write(message, b"", RESPONSE | ACK, 0) if message.wants_ack else b""
        return obp_wire.write(message, data, RESPONSE, 0)

    def _obey(self, kind: int, data: bytes) -> tuple[bytes | None, int]:
        """Return the reply's data (None: only an acknowledgement) and the error number."""
        values = {
            HARDWARE: b"\x03",
            FIRMWARE: b"\x36\x00",
            SERIAL: SERIAL_NUMBER,
            SERIAL_LENGTH: bytes([len(SERIAL_NUMBER)]),
            WAVELENGTH_COUNT: bytes([len(WAVELENGTH_COEFFICIENTS)]),
            NONLINEARITY_COUNT: bytes([len(self.nonlinearity)]),
            GET_TRIGGER: bytes([self.trigger_mode]),
            GET_AVERAGE: struct.pack("<H", self.averages),
            GET_BOXCAR: bytes([self.boxcar]),
        }
        tables = {WAVELENGTH: WAVELENGTH_COEFFICIENTS, NONLINEARITY: self.nonlinearity}
        if kind in values:
            return (values[kind], 0) if not data else (None, BAD_LENGTH)
        if kind in tables:
            if len(data) != 1:
                return None, BAD_LENGTH
            if data[0] >= len(tables[kind]):
                return None, BAD_VALUE
            return struct.pack("<f", tables[kind][data[0]]), 0
        if kind == GET_TEMPERATURE:
            if len(data) != 1:
                return None, BAD_LENGTH
            return (struct.pack("<f", TEMPERATURE), 0) if data[0] == 0 else (None, BAD_VALUE)
        if kind in (RAW, CORRECTED):
            return (self._expose().astype("<u2").tobytes(), 0) if not data else (None, BAD_LENGTH)
        return self._set(kind, data)

    def _set(self, kind: int, data: bytes) -> tuple[None, int]:
        lengths = {RESET: 0, SET_TIME: 4, SET_TRIGGER: 1, SET_AVERAGE: 2, SET_BOXCAR: 1, LAMP: 1}
        if kind not in lengths:
            return None, BAD_TYPE
        if len(data) != lengths[kind]:
            return None, BAD_LENGTH
        value = int.from_bytes(data, "little")
        if kind == RESET:
            self._defaults()
        elif kind == SET_TIME:
            if not SHORTEST <= value / 1e6 <= LONGEST:
                return None, BAD_VALUE
            if value / 1e6 != self.seconds:
                self.seconds_before, self.seconds = self.seconds, value / 1e6
        elif kind == SET_TRIGGER:
            if value > 3:
                return None, BAD_VALUE
            self.trigger_mode = value
        elif kind == SET_AVERAGE:
            if not 1 <= value <= 5000:
                return None, BAD_VALUE
            self.averages = value
        elif kind == SET_BOXCAR:
            if value > 15:
                return None, BAD_VALUE
            self.boxcar = value
        else:
            if value > 1:
                return None, BAD_VALUE
            self.world.move_shutter(bool(value))
        return None, 0

    def _expose(self) -> npt.NDArray[np.uint16]:
        """Integrate; the first spectrum after a change of time is still taken with the old one."""
        before, self.seconds_before = self.seconds_before, None
        seconds = self.seconds if before is None else before
        if self.flash:
            self.flash = False
            self.world.clock.sleep(seconds)
            return np.full(PIXELS, FULL_SCALE, np.uint16)
        scans = []
        for _ in range(self.averages):
            began = self.world.clock.now()
            self.world.clock.sleep(seconds)
            scans.append(self.world.counts(seconds, began).astype(np.float64))
        mean = np.mean(scans, axis=0)
        if self.boxcar:
            width = 2 * self.boxcar + 1
            padded = np.pad(mean, self.boxcar, mode="edge")
            mean = np.convolve(padded, np.ones(width) / width, mode="valid")
        return np.asarray(np.rint(mean), dtype=np.uint16)

    def power_cut(self) -> bytes:
        """Start again; the next reply says so."""
        self._defaults()
        self._was_reset = True
        return b""

    def happens(self, fault: str, request: bytes) -> bool:
        """Flash where it shows: in a spectrum with the shutter open that is not the first after a change."""
        shows = (
            self.text(request) == f"{RAW:08X}"
            and self.seconds_before is None
            and self.shutter
            and not self._was_reset
        )
        if fault == "saturation" and shows:
            self.flash = True
        return shows
