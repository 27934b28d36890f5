"""What a user is told when something cannot be done.

Each message is one line that names the file or argument, the place in it, and the mend. The command
line prints it without a traceback and exits with status 2.
"""

from __future__ import annotations

from contextvars import ContextVar

ON_COMMAND_LINE: ContextVar[bool] = ContextVar("on_command_line", default=False)
"""Whether whoever reads a message gave a command; set by `clbrdf.cli.main` alone."""


def advice(python: str, command: str) -> str:
    """Return the mend in the words of those who read it: an argument in Python, an option of a command."""
    return command if ON_COMMAND_LINE.get() else python


def settled(argument: str, option: str, *values: object) -> str:
    """Return how each of some values is given: an argument in Python, an option of a command."""
    each = [advice(f"{argument}={value!r}", f"{option} {value}") for value in values]
    return " or ".join(each)


LONGEST = 900
"""Characters of a message; what a file quotes of itself may be of any length."""


def shortened(text: str, most: int = 60) -> str:
    """Return a text of at most `most` characters: what is longer loses its middle."""
    if len(text) <= most:
        return text
    tail = (most - 1) // 2
    return f"{text[: most - 1 - tail]}…{text[-tail:] if tail else ''}"


class ClbrdfError(Exception):
    """Anything the user can mend; the base of all errors raised on purpose."""

    def __str__(self) -> str:
        """Return the message, which begins with the place and ends with the mend."""
        return shortened(super().__str__(), LONGEST)


class InputError(ClbrdfError, ValueError):
    """A file, an argument or an array that cannot be used as it is."""


class DeviceError(ClbrdfError, RuntimeError):
    """A device cannot be used: OpenCL (none fits, a kernel fails) or an instrument of the rig."""
