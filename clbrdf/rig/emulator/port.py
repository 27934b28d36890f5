"""A pseudo-terminal that stands for a serial port: a fixed name, the line's speed, a plug to pull."""

from __future__ import annotations

import contextlib
import os
import select
import time
import tty
from pathlib import Path

from clbrdf.errors import InputError

BITS_PER_BYTE = 10
CHUNK = 32
"""Bytes that travel between two pauses when the line's speed is kept."""


class PseudoTerminal:
    """The instrument's end of a serial line.

    Attributes
    ----------
    link : Path
        Where the host finds the port; stays the same when the plug is pulled and put back.
    baud : int or None
        Bits per second to keep to; None for no limit.
    """

    def __init__(self, link: Path, baud: int | None) -> None:
        self.link = link
        self.baud = baud
        self._ends: tuple[int, int] | None = None

    def plug(self) -> None:
        """Open a pseudo-terminal and let the link point to it.

        Raises
        ------
        InputError
            Another emulator or something else has the name of the link, or its folder cannot be made.
        """
        link = self.link
        if link.exists():  # not where a link is left over from an emulator that was killed
            if link.is_symlink() and os.readlink(link).startswith("/dev/pts/"):
                raise InputError(f"{link}: an emulator serves this port; stop that one, or remove the link")
            raise InputError(f"{link}: exists and is no emulated port; give another port in the rig file")
        master, slave = os.openpty()
        tty.setraw(slave)
        os.set_blocking(master, False)
        try:
            link.parent.mkdir(parents=True, exist_ok=True)
            part = link.with_name(f".{link.name}.{os.getpid()}")
            part.unlink(missing_ok=True)
            part.symlink_to(os.ttyname(slave))
            os.replace(part, link)
        except OSError as error:
            os.close(master)
            os.close(slave)
            raise InputError(f"{link}: no emulated port can be put there ({error.strerror})") from error
        # Our own hold on the slave keeps the line up between two programs that open it.
        self._ends = (master, slave)

    @property
    def device(self) -> str:
        """Path of the pseudo-terminal itself."""
        assert self._ends is not None
        return os.ttyname(self._ends[1])

    def unplug(self) -> None:
        """Pull the plug: the host sees the port fail."""
        if self._ends is not None:
            ends, self._ends = self._ends, None
            for end in ends:
                os.close(end)
            with contextlib.suppress(OSError):
                self.link.unlink()

    def read(self, wait: float) -> bytes:
        """Return what has come, b"" after `wait` seconds without any."""
        if self._ends is None:
            time.sleep(wait)
            return b""
        master = self._ends[0]
        if not select.select([master], [], [], wait)[0]:
            return b""
        try:
            data = os.read(master, 4096)
        except OSError:
            return b""
        self._pace(len(data))
        return data

    def write(self, data: bytes) -> None:
        """Send bytes, at the line's speed where there is one."""
        step = CHUNK if self.baud else max(1, len(data))
        for place in range(0, len(data), step):
            part = data[place : place + step]
            self._pace(len(part))
            while part and self._ends is not None:
                try:
                    part = part[os.write(self._ends[0], part) :]
                except BlockingIOError:
                    time.sleep(0.001)
                except OSError:
                    return

    def _pace(self, count: int) -> None:
        if self.baud:
            time.sleep(count * BITS_PER_BYTE / self.baud)
