"""What can go wrong on a line or in an instrument, one class for each way to mend it."""

from __future__ import annotations

from clbrdf.errors import DeviceError


class InstrumentError(DeviceError):
    """An instrument cannot be used; the message names it, its port and the mend."""


class LineFault(InstrumentError):
    """An exchange went wrong on its way; it may be repeated if the request may be."""


class NoReply(LineFault):
    """The deadline passed before the reply was whole."""


class BadReply(LineFault):
    """A reply came that does not read as its protocol says."""


class Unplugged(InstrumentError):
    """The port is gone: reopen it, identify the instrument, home, assume no position."""


class Refused(InstrumentError):
    """The instrument understood and said no."""


class NotReferenced(InstrumentError):
    """A stage has lost its homing, by reset or power cut."""


class Stalled(InstrumentError):
    """A stage stopped, or took too long, before its target."""


class LimitReached(InstrumentError):
    """A stage ran into a limit switch: the point cannot be measured."""


class OutOfBand(InstrumentError):
    """The lamp, a reading or a check point is not where it should be."""


class Stopped(Exception):
    """The user asked to stop (Ctrl-C once); not an error."""
