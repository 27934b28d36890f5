"""What a user is told when something cannot be done.

Each message is one line that names the file or argument, the place in it, and the mend. The command
line prints it without a traceback and exits with status 2.
"""


class ClbrdfError(Exception):
    """Anything the user can mend; the base of all errors raised on purpose."""


class InputError(ClbrdfError, ValueError):
    """A file, an argument or an array that cannot be used as it is."""


class DeviceError(ClbrdfError, RuntimeError):
    """A device cannot be used: OpenCL (none fits, a kernel fails) or an instrument of the rig."""
