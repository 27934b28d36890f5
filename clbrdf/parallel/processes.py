"""A pool of processes that ends with the process that made it, however that ends.

Processes, because nlopt's binding holds Python's lock, so threads would take turns; spawned, so that each
makes its own OpenCL context.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import active_children, get_context, parent_process, resource_tracker
from multiprocessing.connection import wait
from multiprocessing.process import BaseProcess
from types import TracebackType
from typing import TypeVar

from clbrdf.parallel.ending import end_with_parent, signals_later, undone_at_end
from clbrdf.parallel.executor import Executor, Serial
from clbrdf.parallel.threads import ONE_THREAD, environment

J = TypeVar("J")
R = TypeVar("R")

DYING = 2.0
"""How long processes that were killed may take to be gone, s."""


@contextmanager
def pool(count: int) -> Iterator[Executor]:
    """Give `count` processes, or this process alone where that is one."""
    if count == 1:
        yield Serial()
        return
    with Processes(count) as processes:
        yield processes


class Processes:
    """An `Executor` of `count` processes, each with one thread for linear algebra and OpenCL; a context.

    A script that uses it has to guard its main part, as for every use of multiprocessing. Where the block
    ends by an exception the processes are ended, not waited for.
    """

    def __init__(self, count: int) -> None:
        self.count = count
        self._others: set[BaseProcess] = set()

    def __enter__(self) -> Processes:
        self._others = set(active_children())
        start_tracker()
        self._ending = undone_at_end(self._kill_and_wait)
        self._ending.__enter__()
        self._pool = ProcessPoolExecutor(
            self.count, mp_context=get_context("spawn"), initializer=_follow_parent
        )
        return self

    def map(self, function: Callable[[J], R], jobs: Iterable[J], /) -> Iterator[R]:
        """Return function(job) of every job, in their order."""
        every = list(jobs)
        # Ctrl-C in a terminal reaches all of its processes; only this one is to hear it.
        with environment(ONE_THREAD), signals_later():
            return self._pool.map(function, every)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if kind is not None:
                self._kill()
            self._pool.shutdown(cancel_futures=True)
        finally:
            self._ending.__exit__(None, None, None)

    def _kill(self) -> list[BaseProcess]:
        children = list(set(active_children()) - self._others)
        for child in children:
            child.kill()
        return children

    def _kill_and_wait(self) -> None:
        """Kill all, and wait: what a signal has undone next may be a folder that they write in.

        Only the pool itself may join them.
        """
        alive, end = [child.sentinel for child in self._kill()], time.monotonic() + DYING
        while alive and (left := end - time.monotonic()) > 0.0:
            gone = wait(alive, left)
            alive = [sentinel for sentinel in alive if sentinel not in gone]


def start_tracker() -> None:
    """Start the process of `multiprocessing` that removes semaphores when this one ends amid its work.

    Started here, it does so without a warning.
    """
    with environment({"PYTHONWARNINGS": "ignore:resource_tracker:UserWarning"}), signals_later():
        resource_tracker.ensure_running()


def _follow_parent() -> None:
    parent = parent_process()
    assert parent is not None
    end_with_parent(parent.join)
