"""Emulated Newport 1830-C: ASCII, LF, echo on and dBm after power-on."""

from __future__ import annotations

import math
import re

from clbrdf.rig.emulator.world import World

END = b"\n"
READY_BIT, COMMAND_BIT, PARAMETER_BIT = 128, 2, 1
WATTS, DBM = "1", "2"
LAMP_OUT_READINGS = 12
LAMP_OUT = 0.67


class EmulatedPowerMeter:
    """The reference detector as a device of the emulator."""

    name = "reference"

    def __init__(self, world: World) -> None:
        self.world = world
        self._out = 0
        self._defaults()

    def _defaults(self) -> None:
        self.echo = True
        self.units = DBM
        self.wavelength = "0633"
        self.attenuator = "0"
        self.filter = "2"
        self.status = READY_BIT

    def take(self, buffer: bytearray) -> bytes | None:
        """Remove the first line, its LF included."""
        place = buffer.find(END)
        if place < 0:
            return None
        line = bytes(buffer[: place + 1])
        del buffer[: place + 1]
        return line

    def text(self, request: bytes) -> str:
        """Return the line without its end."""
        return request.decode("latin-1").strip()

    def answer(self, request: bytes) -> bytes:
        """Obey one line; with the echo on it is sent back first."""
        line = request[:-1].decode("latin-1").strip().upper()
        echo = request if self.echo else b""
        value = self._obey(line)
        return echo + (b"" if value is None else value.encode("ascii") + END)

    def _obey(self, line: str) -> str | None:
        queries = {
            "U?": self.units,
            "W?": self.wavelength,
            "R?": "0",
            "A?": self.attenuator,
            "F?": self.filter,
            "Q?": str(self.status),
        }
        if line == "D?":
            return self._reading()
        if line in queries:
            return queries[line]
        if line == "CS":
            self.status = READY_BIT
        elif line in ("E0", "E1"):
            self.echo = line == "E1"
        elif re.fullmatch("U[1-4]", line):
            self.units = line[1]
        elif re.fullmatch("W[0-9]{4}", line):
            self.wavelength = line[1:]
        elif re.fullmatch("A[01]", line):
            self.attenuator = line[1]
        elif re.fullmatch("F[123]", line):
            self.filter = line[1]
        else:
            known = line[:1] in "UWAFER" and line[:1] != ""
            self.status |= PARAMETER_BIT if known else COMMAND_BIT
        return None

    def _reading(self) -> str:
        self.world.lamp_factor = LAMP_OUT if self._out else 1.0
        self._out = max(0, self._out - 1)
        power = self.world.reference_reading()
        return scientific(power if self.units == WATTS else 10.0 * math.log10(max(power, 1e-15) / 1e-3))

    def power_cut(self) -> bytes:
        """Start again with echo and dBm."""
        self._defaults()
        return b""

    def happens(self, fault: str, request: bytes) -> bool:
        """Let it happen at a reading, where both show."""
        if self.text(request) != "D?" or self.echo:
            return False
        if fault == "front_panel":
            self.units = DBM
        else:
            self._out = LAMP_OUT_READINGS
        return True


def scientific(value: float) -> str:
    """Return a number the way the meter writes it: 7.5123E-4, 5E-9."""
    mantissa, exponent = f"{value:.4e}".split("e")
    return f"{mantissa.rstrip('0').rstrip('.')}E{int(exponent)}"
