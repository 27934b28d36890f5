"""Where the command `clbrdf` begins.

A module of its own beside the package: signals end the command in one line from here on, also while the
package and its libraries load, which takes most of a second. What is imported here has to be quick.
"""

import os
import signal
import sys
from types import FrameType


def _end_before_work(number: int, frame: FrameType | None) -> None:
    # The words of clbrdf.parallel.ending, which may not be loaded yet. Nothing was begun.
    del frame
    cause = "interrupted" if number == signal.SIGINT else f"ended by {signal.Signals(number).name}"
    try:
        os.write(2, f"clbrdf: {cause}; nothing was left half-written\n".encode())
    finally:
        os._exit(128 + number)


def main() -> int:
    """Run the command line; return the exit status."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _end_before_work)
    from clbrdf.parallel.ending import end_on_signals

    end_on_signals()
    from clbrdf.cli import main as run

    return run()


if __name__ == "__main__":
    sys.exit(main())
