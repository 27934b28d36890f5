"""Independent jobs over processes: nlopt's binding holds Python's lock, so threads would take turns.

Processes are spawned, so that each makes its own OpenCL context; each does linear algebra in one thread.
Ctrl-C reaches the parent alone, which then ends them.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from multiprocessing import active_children, get_context
from typing import TypeVar

from clbrdf.progress import Report, silent

J = TypeVar("J")
R = TypeVar("R")

THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")


def usable_cores() -> int:
    """Return how many cores this process may run on."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def run_jobs(
    work: Callable[[J], R], jobs: Sequence[J], processes: int = 1, report: Report = silent
) -> list[R]:
    """Return work(job) of every job, in their order.

    Parameters
    ----------
    work : callable
        A function of a module, so that a spawned process finds it.
    jobs : sequence
    processes : int
        With 1, all runs in this process.
    report : callable
        Called with (jobs done, jobs in all).
    """
    report(0, len(jobs))
    if processes == 1 or len(jobs) < 2:
        out = []
        for k, job in enumerate(jobs):
            out.append(work(job))
            report(k + 1, len(jobs))
        return out
    ours = set(active_children())
    executor = ProcessPoolExecutor(min(processes, len(jobs)), mp_context=get_context("spawn"))
    try:
        with _one_thread_each(), _interrupts_held():
            places: dict[Future[R], int] = {executor.submit(work, job): k for k, job in enumerate(jobs)}
        results: dict[int, R] = {}
        for future in as_completed(places):
            results[places[future]] = future.result()
            report(len(results), len(jobs))
    except BaseException:
        # Ended, not waited for; the executor then sees to what they leave behind.
        for child in set(active_children()) - ours:
            child.terminate()
        executor.shutdown()
        raise
    executor.shutdown()
    return [results[k] for k in range(len(jobs))]


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """Tell processes that start within the block to do linear algebra in one thread."""
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


@contextmanager
def _interrupts_held() -> Iterator[None]:
    """Hold Ctrl-C back; processes that start within the block never hear it."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
