"""Whether HDF5 can be let at a file: ours by its seal, or read once from end to end in another process.

On a damaged file HDF5 may crash, ask for all memory, or run for ever inside a C function that no signal
reaches. A process can be given limits, and ended (docs/decisions/0140).
"""

from __future__ import annotations

import signal
import subprocess
from functools import lru_cache
from pathlib import Path

from clbrdf.errors import InputError
from clbrdf.parallel.children import run_child
from clbrdf.storage import look
from clbrdf.storage.seal import is_sealed

MEMORY = 1 << 30
"""Bytes that reading may take: four times the largest chunk, which is held stored, unpacked and sorted."""

START, BYTES_PER_SECOND = 5, 5e7
"""Processor time that it may take, s, and that for each byte of the file."""

WAIT = 20.0
"""How often its time may pass while other programs keep the processor busy."""

ENDLESS = "reading it does not come to an end"


def check_sound(path: Path) -> None:
    """Make sure that HDF5 comes to an end with a file.

    Raises
    ------
    InputError
        It is damaged, or points to other files.
    """
    if is_sealed(path):
        return
    found = path.stat()
    wrong = _look(str(path.resolve()), (found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns))
    if "truncated" in wrong:
        raise InputError(f"{path}: truncated HDF5 file; copy it again from its source")
    if wrong:
        raise InputError(
            f"{path}: damaged HDF5 file ({wrong}); copy it again from its source, or make it again"
        )


@lru_cache(maxsize=256)
def _look(path: str, state: tuple[int, ...]) -> str:
    """Look at a file in another process, once for each state of it; return what is wrong with it, or ""."""
    seconds = START + int(state[2] / BYTES_PER_SECOND)
    words = [look.__file__, path, str(MEMORY), str(seconds)]
    one_thread = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    try:
        done = run_child(words, timeout=WAIT * seconds, environment=one_thread)
    except subprocess.TimeoutExpired:
        return ENDLESS
    return fault_of(done.returncode, done.stdout)


def fault_of(status: int, output: str) -> str:
    """Return what the exit status and the output of `look.py` say is wrong with a file, or ""."""
    if status == 0:
        return ""
    said = output.strip()
    if status == 1 and said:
        return said
    return ENDLESS if status in (-signal.SIGXCPU, -signal.SIGKILL) else "HDF5 fails on it"
