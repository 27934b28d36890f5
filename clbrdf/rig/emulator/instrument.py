"""One emulated instrument: a thread that reads requests, answers them, and lets faults happen."""

from __future__ import annotations

import threading
import time
from typing import Protocol

from clbrdf.rig.emulator.faults import REPLY_FAULTS, Injector
from clbrdf.rig.emulator.port import PseudoTerminal

UNPLUGGED_TIME = 0.1
"""How long a pulled plug stays out, s."""

WAKE = 0.05


class EmulatedDevice(Protocol):
    """What the thread asks of an instrument."""

    name: str

    def take(self, buffer: bytearray) -> bytes | None:
        """Remove the first whole request from the buffer and return its bytes."""

    def answer(self, request: bytes) -> bytes:
        """Do what a request says and return the reply, b"" for none."""

    def power_cut(self) -> bytes:
        """Start again with the defaults; return what the line carries meanwhile."""

    def happens(self, fault: str, request: bytes) -> bool:
        """Let one of the instrument's own faults happen; False where it would not show now."""

    def text(self, request: bytes) -> str:
        """Return a request in words, to choose faults by."""


class EmulatedInstrument(threading.Thread):
    """Serves one device on one port until `close`."""

    def __init__(self, device: EmulatedDevice, port: PseudoTerminal, injector: Injector) -> None:
        super().__init__(name=f"emulated {device.name}", daemon=True)
        self.device = device
        self.port = port
        self.injector = injector
        self.exchanges = 0
        self._held = b""
        self._buffer = bytearray()
        self._closing = threading.Event()

    def run(self) -> None:
        """Answer requests until closed."""
        while not self._closing.is_set():
            self._buffer += self.port.read(WAKE)
            while (request := self.device.take(self._buffer)) is not None:
                self.exchanges += 1
                self._serve(request)

    def close(self) -> None:
        """Stop the thread and remove the port."""
        self._closing.set()
        self.join()
        self.port.unplug()

    def _serve(self, request: bytes) -> None:
        words = self.device.text(request)
        for fault in self.injector.draw(self.device.name, self.exchanges, words):
            if fault in REPLY_FAULTS:
                reply = self.device.answer(request)
                if not reply:  # nothing to spoil: the fault waits for a request with a reply
                    return
                self._note(fault, words)
                if fault == "stale_reply":
                    self._held += reply
                else:
                    self._send(self._spoiled(fault, reply))
                return
            if fault == "lost_command_byte":
                self._note(fault, words)
                place = int(self.injector.random[self.device.name].integers(len(request)))
                self._buffer[:0] = request[:place] + request[place + 1 :]
                damaged = self.device.take(self._buffer)
                if damaged is not None:
                    self._send(self.device.answer(damaged))
                return
            if fault == "unplug":
                self._note(fault, words)
                self._replug()
                return
            if fault == "power_cut":
                self._note(fault, words)
                self._held = b""
                self._send(self.device.power_cut())
                return
            if self.device.happens(fault, request):
                self._note(fault, words)
                break
        self._send(self.device.answer(request))

    def _send(self, reply: bytes) -> None:
        held, self._held = self._held, b""
        self.port.write(held + reply)

    def _spoiled(self, fault: str, reply: bytes) -> bytes:
        random = self.injector.random[self.device.name]
        place = int(random.integers(len(reply)))
        if fault == "short_read":
            return reply[:place]
        if fault == "garbage":
            noise = bytes(random.integers(0x80, 0x100, int(random.integers(3, 20)), dtype="u1"))
            return reply[:place] + noise + reply[place:]
        if fault == "nul_bytes":
            return bytes(int(random.integers(1, 5))) + reply
        if fault == "lost_byte":
            return reply[:place] + reply[place + 1 :]
        return reply + reply if fault == "duplicate_reply" else b""

    def _replug(self) -> None:
        self._held = b""
        self._buffer.clear()
        self.port.unplug()
        time.sleep(UNPLUGGED_TIME)
        self.port.plug()

    def _note(self, fault: str, words: str) -> None:
        self.injector.happened(self.device.name, self.exchanges, fault, words)
