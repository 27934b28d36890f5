"""Read damaged files, one after the other: `python -m tests.damaged.worker FOLDER START STOP SEED`.

FOLDER/sound holds the sound files. The number of the file that is read stands in FOLDER/now-START, so that
one that crashes this process is known; what came out is written as JSON to FOLDER/done-START.
"""

from __future__ import annotations

import json
import os
import resource
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from types import FrameType

import numpy as np

from clbrdf import InputError
from clbrdf.bench.memory import peak_memory
from clbrdf.errors import LONGEST
from clbrdf.rig import segmentcheck
from clbrdf.rig.segment import read_header, read_rows
from clbrdf.storage import look, sound
from tests.damaged.hdf5_damage import damage
from tests.damaged.sources import readers
from tests.formats.mutate import mutated

SECONDS = 10
"""Processor time of one file."""

OFTEN = 3
"""How often text, and HDF5 that was sealed again, come for each file of HDF5 with flipped bytes."""


class HangError(BaseException):
    """A file takes too long."""


def _hang(number: int, frame: FrameType | None) -> None:
    raise HangError


def forked(work: Callable[[], object], seconds: int) -> tuple[int, str]:
    """Do something in a fork of this process with limits; return its exit status and output.

    That takes a tenth of the time of a new process, which `command_line` of test_mutated.py has.
    """
    with tempfile.TemporaryFile() as said:
        child = os.fork()
        if child == 0:
            os.dup2(said.fileno(), 1)
            status = 1
            try:
                look.limit(sound.MEMORY, seconds)
                work()
                status = 0
            except BaseException as error:
                print((str(error).strip() or type(error).__name__).splitlines()[0], flush=True)
            finally:
                os._exit(status)
        _, status = os.waitpid(child, 0)
        said.seek(0)
        return os.waitstatus_to_exitcode(status), said.read().decode("utf-8", "replace")


def look_at(path: str, state: tuple[int, ...]) -> str:
    """Look at an HDF5 file as `sound._look` does."""
    seconds = sound.START + int(state[2] / sound.BYTES_PER_SECOND)
    return sound.fault_of(*forked(lambda: look.look(path), seconds))


def segment(path: Path) -> None:
    """Read a segment as `follow` does: first in a process that can be ended."""
    status, said = forked(lambda: (read_header(path), read_rows(path)), int(segmentcheck.START_TIME))
    if status == 1 and str(path) in said:
        raise InputError(said.strip())
    if status:
        raise InputError(f"{path}: damaged segment")
    read_header(path)
    read_rows(path)


def kinds(names: list[str]) -> list[tuple[str, str]]:
    """Return kind of file and kind of damage, in the order in which they come."""
    out: list[tuple[str, str]] = []
    for name in names:
        if name.endswith(".h5"):
            # A segment is not sealed; it is always read as an image of its own.
            out += [(name, "bytes"), (name, "said")] + [(name, "sealed")] * (OFTEN - 1)
        else:
            out += [(name, "bytes")] * OFTEN
    return out


def make(folder: Path, number: int, seed: int, names: list[str]) -> tuple[str, str, Path]:
    """Write a damaged file; return its kind, its damage and where it is."""
    order = kinds(names)
    name, how = order[number % len(order)]
    rng = np.random.default_rng([seed, number])
    path = folder / f"damaged-{number}{Path(name).suffix}"
    content = (folder / "sound" / name).read_bytes()
    if how == "bytes":
        path.write_bytes(mutated(content, rng, most=2))
    else:
        path.write_bytes(content)
        damage(path, rng, how == "sealed")
    return name, how, path


def main(words: list[str]) -> int:
    """Read the files START to STOP."""
    folder, start, stop, seed = Path(words[0]), *map(int, words[1:4])
    warnings.simplefilter("error")
    signal.signal(signal.SIGPROF, _hang)
    sound._look = look_at
    by_kind = {**readers(folder), "segment.h5": segment}
    names = sorted(name for name in by_kind if (folder / "sound" / name).exists())
    counts: Counter[str] = Counter()
    failures: list[dict[str, object]] = []
    slowest = 0.0
    for number in range(start, stop):
        (folder / f"now-{start}").write_text(str(number))
        name, how, path = make(folder, number, seed, names)
        began = time.process_time()
        signal.setitimer(signal.ITIMER_PROF, SECONDS)
        try:
            by_kind[name](path)
            verdict = "read"
        except InputError as error:
            verdict = "refused"
            text = str(error)
            if "\n" in text or len(text) > LONGEST or path.name not in text:
                verdict = "poor message"
                failures.append({"number": number, "name": name, "how": how, "error": text[:1000]})
        except HangError:
            verdict = "hang"
            failures.append(
                {"number": number, "name": name, "how": how, "error": traceback.format_exc()[-900:]}
            )
        except Exception:
            verdict = "traceback"
            failures.append(
                {"number": number, "name": name, "how": how, "error": traceback.format_exc()[-1500:]}
            )
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0.0)
        slowest = max(slowest, time.process_time() - began)
        counts[f"{name} {how} {verdict}"] += 1
        path.unlink()
    peak = max(peak_memory() >> 10, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
    content = {"counts": counts, "failures": failures, "peak": peak, "slowest": slowest}
    (folder / f"done-{start}").write_text(json.dumps(content))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
