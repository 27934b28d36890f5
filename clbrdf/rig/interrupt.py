"""Ctrl-C and Ctrl-Z during a measurement.

The first Ctrl-C finishes the exchange and stops cleanly, the second stops at once. Ctrl-Z finishes the point
and pauses there; `fg` goes on.
"""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable
from types import FrameType, TracebackType
from typing import Any

from clbrdf.rig.errors import StoppedError


class StopRequest:
    """While the context lasts, SIGINT and SIGTERM ask to stop; a second one interrupts.

    `check` is called between exchanges and raises `StoppedError` once a stop was asked for. On a second
    signal KeyboardInterrupt is raised wherever the program is; the measurement then stops the stages
    and closes the shutter on its way out. Python drops what is raised in a destructor or in the callback of a
    weak reference: where that happened, the next `check` raises KeyboardInterrupt again.

    Attributes
    ----------
    number : int
        Of the first signal; 0 before it.
    told : callable
        Called at the first signal, to tell the user what happens now.
    told_pause : callable
        Called when a pause is asked for.
    """

    def __init__(self, told: Callable[[], None], told_pause: Callable[[], None] = lambda: None) -> None:
        self.told = told
        self.told_pause = told_pause
        self.number = 0
        self.is_urgent = False
        self.is_pausing = False
        self._before: dict[int, Any] = {}

    def __enter__(self) -> StopRequest:
        for number in (signal.SIGINT, signal.SIGTERM):
            self._before[number] = signal.signal(number, self._asked)
        self._before[signal.SIGTSTP] = signal.signal(signal.SIGTSTP, self._asked_to_pause)
        self._tell_dropped, sys.unraisablehook = sys.unraisablehook, self._dropped
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        sys.unraisablehook = self._tell_dropped
        # Once a stop was asked for the program ends: a late signal must not disturb its last words.
        for number, handler in self._before.items():
            signal.signal(number, signal.SIG_IGN if self.is_asked else handler)

    def _asked(self, number: int, frame: FrameType | None) -> None:
        del frame
        if self.is_asked:
            self.is_urgent = True
            raise KeyboardInterrupt
        self.number = number
        self.told()

    def _dropped(self, dropped: sys.UnraisableHookArgs) -> None:
        """Say nothing of a KeyboardInterrupt that Python drops: `check` raises it again."""
        if not issubclass(dropped.exc_type, KeyboardInterrupt):
            self._tell_dropped(dropped)

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
        """Raise StoppedError if the user asked to stop, KeyboardInterrupt if twice."""
        if self.is_urgent:
            raise KeyboardInterrupt
        if self.is_asked:
            raise StoppedError

    @property
    def is_asked(self) -> bool:
        """Whether the user asked to stop."""
        return self.number != 0
