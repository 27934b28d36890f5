"""Ctrl-C and Ctrl-Z during a measurement.

The first Ctrl-C finishes the exchange and stops cleanly, the second stops at once. Ctrl-Z finishes the point
and pauses there; `fg` goes on.
"""

from __future__ import annotations

import os
import signal
import threading
import weakref
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
    told_pause : callable
        Called when a pause is asked for.
    """

    def __init__(self, told: Callable[[], None], told_pause: Callable[[], None] = lambda: None) -> None:
        self.told = told
        self.told_pause = told_pause
        self.is_asked = False
        self.is_pausing = False
        self._before: dict[int, Any] = {}

    def __enter__(self) -> StopRequest:
        for number in (signal.SIGINT, signal.SIGTERM):
            self._before[number] = signal.signal(number, self._asked)
        self._before[signal.SIGTSTP] = signal.signal(signal.SIGTSTP, self._asked_to_pause)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        # Once a stop was asked for the program ends: a late signal must not disturb its last words.
        for number, handler in self._before.items():
            signal.signal(number, signal.SIG_IGN if self.is_asked else handler)

    def _asked(self, number: int, frame: FrameType | None) -> None:
        if self.is_asked and frame is not None and frame.f_code.co_filename == weakref.__file__:
            # What is raised in a callback of a weak reference is lost: the signal comes once more.
            threading.Timer(0.01, os.kill, (os.getpid(), number)).start()
            return
        if self.is_asked:
            raise KeyboardInterrupt
        self.is_asked = True
        self.told()

    def _asked_to_pause(self, number: int, frame: FrameType | None) -> None:
        del number, frame
        self.is_pausing = True
        self.told_pause()

    def pause(self, make_safe: Callable[[], None]) -> bool:
        """Stop the process where a pause was asked for, until it is continued; say whether it was.

        `make_safe` is called before it stops.
        """
        if not self.is_pausing:
            return False
        self.is_pausing = False
        make_safe()
        signal.raise_signal(signal.SIGSTOP)
        return True

    def check(self) -> None:
        """Raise StoppedError if the user asked to stop."""
        if self.is_asked:
            raise StoppedError
