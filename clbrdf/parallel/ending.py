"""How a command ends at SIGINT and SIGTERM: at once, with nothing left behind.

The handler undoes what is half made and ends the process there. It raises nothing: an exception at a place
that nobody chose is lost in callbacks and destructors, is turned into another one by imports, and aborts
libraries of C++ that let none pass.

Whoever makes something that must not outlive the process says how to undo it, for as long as it is
there: temporary files, folders, children. Only commands end in this way; importing clbrdf changes no handler.
"""

from __future__ import annotations

import os
import shutil
import signal
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType

SIGNALS = (signal.SIGINT, signal.SIGTERM)

_undo: list[Callable[[], object]] = []  # of this process, as its signal handlers are


def exit_status(number: int) -> int:
    """Return the exit status of a process that a signal has ended, as shells count it."""
    return 128 + number


def ended_words(number: int) -> str:
    """Return what the user is told."""
    cause = "interrupted" if number == signal.SIGINT else f"ended by {signal.Signals(number).name}"
    return f"clbrdf: {cause}; nothing was left half-written"


def end_on_signals() -> None:
    """From here on SIGINT and SIGTERM end this process with status 130 and 143; for the main thread."""
    for number in SIGNALS:
        signal.signal(number, _end)


@contextmanager
def undone_at_end(undo: Callable[[], object]) -> Iterator[None]:
    """Have `undo` called where a signal ends the process within the block.

    It runs at any place of the block, so it must not wait for what the block holds, and has to work before
    the thing is made and after it has gone.
    """
    _undo.append(undo)
    try:
        yield
    finally:
        _undo.remove(undo)


@contextmanager
def scratch_folder(prefix: str = "clbrdf-") -> Iterator[Path]:
    """Give a temporary folder that goes with the block, or with the process."""
    made: list[str] = []

    def remove() -> None:
        for name in made:
            shutil.rmtree(name, ignore_errors=True)

    with undone_at_end(remove):
        try:
            with signals_later():
                made.append(tempfile.mkdtemp(prefix=prefix))
            yield Path(made[0])
        finally:
            remove()


@contextmanager
def interrupt_raises() -> Iterator[None]:
    """Let SIGINT raise KeyboardInterrupt within the block, as in any Python program."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def signals_later() -> Iterator[None]:
    """Hold signals back while something is made; what starts within the block never hears them."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def end_with_parent(wait: Callable[[], object]) -> None:
    """End this process as soon as `wait` returns, in whatever state it is: its parent has gone.

    `wait` runs in a thread of its own.
    """

    def watch() -> None:
        wait()
        os._exit(1)

    threading.Thread(target=watch, name="clbrdf-parent-watch", daemon=True).start()


def _end(number: int, frame: FrameType | None) -> None:
    del frame
    for each in SIGNALS:
        signal.signal(each, signal.SIG_IGN)
    for undo in reversed(_undo):
        with suppress(BaseException):
            undo()
    with suppress(BaseException):
        sys.stdout.flush()
    # A progress bar may have hidden the cursor, and stands in the line that the message takes.
    start = "\r\x1b[K\x1b[?25h" if sys.stderr is not None and os.isatty(2) else ""
    with suppress(BaseException):
        os.write(2, f"{start}{ended_words(number)}\n".encode())
    os._exit(exit_status(number))
