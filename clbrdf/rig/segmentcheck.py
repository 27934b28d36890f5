"""Look at segment files in a process of their own before they are trusted.

HDF5 can run for ever in a file with a damaged block, inside a C function that nothing interrupts. A
process can be ended.
"""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from clbrdf.errors import InputError
from clbrdf.parallel.children import follow_parent, run_child
from clbrdf.rig.segment import read_header, read_rows
from clbrdf.storage.look import limit
from clbrdf.storage.sound import MEMORY

START_TIME, BYTES_PER_SECOND = 5.0, 2e6
"""Processor time that starting the process and reading may take, s and bytes/s."""

BUSY = 20.0
"""How often its time may pass while other programs keep the processor busy."""

COPIES = 4
"""How often the rows of a segment are held while they are read and checked."""

CODE = "import sys; from clbrdf.rig.segmentcheck import look_at_segments; look_at_segments(sys.argv[1:])"


def look_at_segments(words: Sequence[str]) -> None:
    """Read segments from end to end, naming each before it is read and what is wrong with it.

    The first word is the processor time that it may take, s.
    """
    follow_parent()
    size = sum(Path(path).stat().st_size for path in words[1:])
    limit(MEMORY + COPIES * size, int(words[0]))
    for path in words[1:]:
        print(path, flush=True)
        try:
            read_header(Path(path))
            read_rows(Path(path))
        except InputError as error:
            print(error, file=sys.stderr)
            sys.exit(1)


def check_segments(paths: Sequence[Path]) -> None:
    """Make sure that segments can be read.

    Raises
    ------
    InputError
        One is damaged, or reading it does not come to an end.
    """
    if not paths:
        return
    size = sum(path.stat().st_size for path in paths)
    seconds = START_TIME + size / BYTES_PER_SECOND
    try:
        done = run_child(["-c", CODE, str(int(seconds)), *map(str, paths)], timeout=BUSY * seconds)
    except subprocess.TimeoutExpired as error:
        seen = (error.stdout or b"").decode("utf-8", "replace").splitlines()
        raise InputError(
            f"{seen[-1] if seen else paths[0]}: damaged segment (reading it does not come to an end); restore"
            " it from a copy, or remove it to measure its points again"
        ) from error
    if done.returncode == 0:
        return
    lines = done.stderr.strip().splitlines()
    if done.returncode == 1 and len(lines) == 1:
        raise InputError(lines[0])
    seen_text = done.stdout.strip().splitlines()
    said = "HDF5 fails on it"
    if done.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
        said = "reading it does not come to an end"
    raise InputError(
        f"{seen_text[-1] if seen_text else paths[0]}: damaged segment ({said}); restore it from a copy, or"
        " remove it to measure its points again"
    )
