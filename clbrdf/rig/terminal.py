"""Questions to the person at the terminal."""

from __future__ import annotations

import os
import select
from collections.abc import Callable

from clbrdf.rig.connection import nobody

TERMINAL = "/dev/tty"
POLL = 0.2
MOST_BYTES = 4096


def make_ask(check: Callable[[], None]) -> Callable[[str], str]:
    """Return a function that puts a question on the controlling terminal and waits for a line.

    `check` is called while it waits; it raises `StoppedError` where the user wants to stop.
    """

    def ask(question: str) -> str:
        try:
            handle = os.open(TERMINAL, os.O_RDWR | os.O_NOCTTY)
        except OSError:
            return nobody(question)
        try:
            os.write(handle, f"\n{question}: ".encode())
            answer = b""
            while not answer.endswith(b"\n"):
                check()
                if select.select([handle], [], [], POLL)[0]:
                    data = os.read(handle, MOST_BYTES)
                    if not data:
                        return nobody(question)
                    answer += data
            return answer.decode("utf-8", "replace").strip()
        finally:
            os.close(handle)

    return ask
