"""How much memory a process has needed."""

from __future__ import annotations

import sys
from pathlib import Path


def peak_memory() -> int:
    """Return the largest resident memory of this process since it began, bytes.

    On Linux from /proc: the figure of getrusage there includes the process that this one was started from.
    """
    status = Path("/proc/self/status")
    if status.exists():
        for line in status.read_text().splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) * 1024
    import resource

    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit
