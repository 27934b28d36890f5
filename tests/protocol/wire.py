"""A peer on a real pseudo-terminal that plays a literal dialogue, byte for byte."""

from __future__ import annotations

import os
import select
import threading
import time
import tty

from clbrdf.rig.eventlog import EventLog
from clbrdf.rig.transport import SerialLine

PATIENCE = 5.0
"""Margin on deadlines where nothing is meant to be late, s: the machine may be busy."""

IMPATIENT = 0.2
"""Where the deadline is meant to pass, s."""


class Dialogue(threading.Thread):
    """Reads exactly the bytes expected and answers with the bytes given; more of them after a while."""

    def __init__(self, *steps: tuple) -> None:
        super().__init__(daemon=True)
        self.steps = steps
        self.heard: list[bytes] = []
        self.master, self.slave = os.openpty()
        tty.setraw(self.slave)
        self.port = os.ttyname(self.slave)
        self.start()

    def run(self) -> None:
        for expected, reply, *late in self.steps:
            data = b""
            while len(data) < len(expected):
                if not select.select([self.master], [], [], 5.0)[0]:
                    break
                data += os.read(self.master, len(expected) - len(data))
            self.heard.append(data)
            os.write(self.master, reply)
            if late:
                time.sleep(late[0])
                os.write(self.master, late[1])

    def __enter__(self) -> Dialogue:
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        self.join(timeout=20.0)
        rest = os.read(self.master, 4096) if select.select([self.master], [], [], 0.05)[0] else b""
        os.close(self.master)
        os.close(self.slave)
        if kind is None:
            assert self.heard == [step[0] for step in self.steps]
            assert rest == b""

    def line(self, patience: float = PATIENCE) -> SerialLine:
        line = SerialLine("device", self.port, 115200, patience, 0.02, EventLog())
        line.open()
        return line


def kinds(line: SerialLine) -> list[str]:
    """Kinds of the events logged so far."""
    return [event.kind for event in line.log.events]
