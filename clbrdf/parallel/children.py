"""Work that must survive its own crash: Python in a child process, which ends when its parent does."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence

from clbrdf.parallel.ending import end_with_parent, signals_later, undone_at_end


def run_child(
    words: Sequence[str], *, timeout: float | None = None, environment: Mapping[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    """Run Python with some arguments, such as ``-m`` and a module; return its status, output and errors.

    The current folder is not searched for modules. The standard input of the child stays open as long as this
    process lives; a child of ours follows it with `follow_parent`.

    Raises
    ------
    subprocess.TimeoutExpired
        It took longer than `timeout` seconds, and was killed; what it wrote stands in the exception.
    """
    started: list[subprocess.Popen[str]] = []

    def kill() -> None:
        for process in started:
            process.kill()

    with undone_at_end(kill):
        with signals_later():
            started.append(
                subprocess.Popen(
                    [sys.executable, "-P", *words],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.PIPE,
                    text=True,
                    env=None if environment is None else {**os.environ, **environment},
                )
            )
        with started[0] as process:
            stdin, process.stdin = process.stdin, None  # communicate would close it
            try:
                out, err = process.communicate(timeout=timeout)
            except BaseException:
                process.kill()
                raise
            finally:
                if stdin is not None:
                    with contextlib.suppress(OSError):
                        stdin.close()
    return subprocess.CompletedProcess(process.args, process.returncode, out, err)


def follow_parent() -> None:
    """End this process when the one that started it by `run_child` has gone."""

    def until_closed() -> None:
        while os.read(0, 4096):  # unlike sys.stdin, it holds no lock that the end of the process waits for
            pass

    end_with_parent(until_closed)
