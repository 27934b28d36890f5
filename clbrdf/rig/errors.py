"""What can go wrong on a line or in an instrument, one class for each way to mend it."""

from __future__ import annotations

from clbrdf.errors import DeviceError, advice


def go_on() -> str:
    """Return how a measurement that was stopped goes on, in the words of those who read it."""
    return f"go on with {advice('resume=True', '--resume')}"


class InstrumentError(DeviceError):
    """An instrument cannot be used; the message names it, its port and the mend."""


class LineError(InstrumentError):
    """An exchange went wrong on its way; it may be repeated if the request may be."""


class NoReplyError(LineError):
    """The deadline passed before the reply was whole."""


class BadReplyError(LineError):
    """A reply came that does not read as its protocol says."""


class UnpluggedError(InstrumentError):
    """The port is gone: reopen it, identify the instrument, home, assume no position."""


class RefusedError(InstrumentError):
    """The instrument understood and said no."""


class NotReferencedError(InstrumentError):
    """A stage has lost its homing, by reset or power cut."""


class StalledError(InstrumentError):
    """A stage stopped, or took too long, before its target."""


class LimitReachedError(InstrumentError):
    """A stage ran into a limit switch: the point cannot be measured."""


class OutOfBandError(InstrumentError):
    """The lamp, a reading or a check point is not where it should be."""


class UnmendedError(OutOfBandError):
    """Something that trying again will not mend: a person has to look (lamp, fibre, shutter, sample)."""


class StorageError(DeviceError):
    """The disk is full, or nearly so; committed rows are safe, and trying again does not help."""


class StoppedError(Exception):
    """The user asked to stop (Ctrl-C once); not an error."""
