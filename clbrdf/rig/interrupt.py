"""Ctrl-C during a measurement: the first finishes the exchange and stops cleanly, the second at once."""

from __future__ import annotations

import signal
from collections.abc import Callable
from types import FrameType, TracebackType
from typing import Any

from clbrdf.rig.errors import StoppedError


class StopRequest:
    """While the context lasts, SIGINT and SIGTERM ask to stop; a second one interrupts.

    `check` is called between exchanges and raises `StoppedError` once a stop was asked for. On a second
    signal KeyboardInterrupt is raised wherever the program is; the measurement then stops the stages
    and closes the shutter on its way out.

    Attributes
    ----------
    told : callable
        Called at the first signal, to tell the user what happens now.
    """

    def __init__(self, told: Callable[[], None]) -> None:
        self.told = told
        self.is_asked = False
        self._before: dict[int, Any] = {}

    def __enter__(self) -> StopRequest:
        for number in (signal.SIGINT, signal.SIGTERM):
            self._before[number] = signal.signal(number, self._asked)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        # Once a stop was asked for the program ends: a late signal must not disturb its last words.
        for number, handler in self._before.items():
            signal.signal(number, signal.SIG_IGN if self.is_asked else handler)

    def _asked(self, number: int, frame: FrameType | None) -> None:
        del number, frame
        if self.is_asked:
            raise KeyboardInterrupt
        self.is_asked = True
        self.told()

    def check(self) -> None:
        """Raise StoppedError if the user asked to stop."""
        if self.is_asked:
            raise StoppedError
