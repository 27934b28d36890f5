"""The seam for parallel work: whatever has a `map`.

`Serial` and `clbrdf.parallel.processes.Processes` are here; every `concurrent.futures.Executor` is one, and
with it Dask: ``Client(...).get_executor()``.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from typing import Protocol, TypeVar

from clbrdf.progress import Report, silent

J = TypeVar("J")
R = TypeVar("R")


class Executor(Protocol):
    """Runs a function on many jobs."""

    def map(self, function: Callable[[J], R], jobs: Iterable[J], /) -> Iterable[R]:
        """Return function(job) of every job, in their order.

        Where jobs run in other processes, the function is one of a module, and jobs and results can be
        pickled.
        """


class Serial:
    """One job after the other, in this process."""

    def map(self, function: Callable[[J], R], jobs: Iterable[J], /) -> Iterator[R]:
        """Return function(job) of every job, each when it is asked for."""
        return map(function, jobs)


def run_jobs(
    executor: Executor, function: Callable[[J], R], jobs: Iterable[J], total: int, report: Report = silent
) -> list[R]:
    """Return function(job) of all jobs, and report (jobs done, `total`)."""
    report(0, total)
    out: list[R] = []
    for result in executor.map(function, jobs):
        out.append(result)
        report(len(out), total)
    return out


def usable_cores() -> int:
    """Return how many cores this process may run on."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
