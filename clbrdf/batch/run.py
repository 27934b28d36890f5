"""A batch from start to end: tasks handed out, results kept as they come, what fails told and left behind."""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from clbrdf.batch.cluster import ANSWER_TIME
from clbrdf.batch.folder import INDEX, Catalogue
from clbrdf.batch.tasks import (
    Done,
    Look,
    SolvedBlock,
    Source,
    UnfitWorkerError,
    UnseenError,
    finish,
    look,
    solve_block,
)
from clbrdf.errors import ClbrdfError, InputError
from clbrdf.progress import Report, silent

if TYPE_CHECKING:
    from distributed import Client, Future

AHEAD = 4
"""Tasks a worker that wait for it, so that none is idle while the client decides what comes next."""

ATTEMPTS = 64
"""Workers without a device that a task may meet before it is given up."""

BETWEEN_LOOKS = 2.0
"""Seconds between two looks at which workers are there, where some cannot take part."""


@dataclass
class _Scan:
    """A scan on its way."""

    source: Source
    data: Any = None  # a future of its bytes, once a worker did not see the file
    found: Look | None = None
    parts: dict[int, SolvedBlock] = field(default_factory=dict)
    attempts: int = 0
    is_over: bool = False


@dataclass(frozen=True)
class _Task:
    """A task under way; `workers` are those that may take it, all where there are none."""

    scan: _Scan
    kind: str
    place: int
    workers: frozenset[str]


@dataclass(frozen=True)
class Outcome:
    """What came of a batch.

    Attributes
    ----------
    fitted, kept : int
        Scans that were fitted, and that were done before.
    failed : mapping of str to str
        Why, by the path of the scan, or of the index.
    wavelengths : Counter
        Of the scans that were fitted, by status.
    sent : int
        Bytes of scans that workers did not see.
    tasks : int
    """

    fitted: int
    kept: int
    failed: dict[str, str]
    wavelengths: Counter[str]
    sent: int
    tasks: int


@dataclass
class _Batch:
    client: Client
    catalogue: Catalogue
    workers: int
    tell: Callable[[str], object]
    bad: dict[str, str]
    queue: Any
    under_way: dict[Future, _Task] = field(default_factory=dict)
    sending: bool = False
    fitted: int = 0
    kept: int = 0
    failed: dict[str, str] = field(default_factory=dict)
    wavelengths: Counter[str] = field(default_factory=Counter)
    sent: int = 0
    tasks: int = 0

    def submit(self, scan: _Scan, kind: str, place: int = 0) -> None:
        """Hand a task to the cluster: "look", "solve" or "finish"."""
        request, digest = self.catalogue.request, "" if scan.found is None else scan.found.sha256
        base = (scan.source, scan.data, request)
        if kind == "look":
            words: tuple[Any, ...] = (look, *base)
        elif kind == "solve":
            words = (solve_block, *base, digest, place)
        else:
            parts = [scan.parts[k] for k in sorted(scan.parts)]
            words = (finish, *base, digest, parts, str(self.catalogue.folder.absolute()))
        # Scans that are begun come before new ones, so that files appear and memory stays bounded.
        priority = {"look": 0, "solve": 1, "finish": 2}[kind]
        able = self.able() if self.bad else None
        future = self.client.submit(*words, pure=False, priority=priority, workers=able)
        self.under_way[future] = _Task(scan, kind, place, frozenset(able or ()))
        self.tasks += 1
        self.queue.add(future)

    def able(self) -> list[str]:
        """Return the addresses of the workers that are there and can take part; some may just be starting.

        Raises
        ------
        ClbrdfError
            There is none.
        """
        deadline = time.monotonic() + ANSWER_TIME
        while time.monotonic() < deadline:
            there = self.client.nthreads()
            if able := [address for address in there if address not in self.bad]:
                return able
            time.sleep(0.2)
        address, reason = next(iter(self.bad.items()))
        raise ClbrdfError(
            f"no worker is left that can take part; {address}: {reason}; mend that, then go on with --resume"
        )

    def next(self) -> Future:
        """Return the next task that has ended.

        Where some workers cannot take part, tasks are bound to the others: one whose workers have all gone is
        handed out again.
        """
        looked = time.monotonic()
        while self.bad and not self.queue.has_ready():
            time.sleep(0.01)
            if time.monotonic() - looked > BETWEEN_LOOKS:
                there = set(self.able())
                for lost, task in list(self.under_way.items()):
                    if task.workers and not task.workers & there:
                        del self.under_way[lost]
                        lost.release()
                        self.submit(task.scan, task.kind, task.place)
                looked = time.monotonic()
        future: Future = next(self.queue)
        return future

    def take(self, future: Future) -> None:
        """Go on with a scan whose task has ended."""
        task = self.under_way.pop(future, None)
        if task is None or task.scan.is_over:
            return
        scan, kind, place = task.scan, task.kind, task.place
        error = None
        if future.status == "finished":
            result = future.result()
        else:
            error = future.exception() if future.status == "error" else None
            if error is None:
                raise _lost(self.client)
        if error is None:
            self.go_on(scan, kind, place, result)
        elif isinstance(error, UnseenError) and scan.data is None:
            self.send(scan, kind, place)
        elif isinstance(error, UnfitWorkerError) and scan.attempts < ATTEMPTS:
            address, reason = error.args
            if address not in self.bad:
                self.bad[address] = reason
                self.tell(f"worker {address} is left out: {reason}")
            scan.attempts += 1
            self.submit(scan, kind, place)
        else:
            self.fail(scan, _words(error))

    def go_on(self, scan: _Scan, kind: str, place: int, result: Any) -> None:
        """Hand out what comes after a task that went well."""
        if kind == "look":
            scan.found = result
            if self.catalogue.is_done(scan.source, result.sha256):
                self.kept += 1
                scan.is_over = True
                return
            for k in range(result.blocks):
                self.submit(scan, "solve", k)
            if result.blocks == 0:
                self.submit(scan, "finish")
        elif kind == "solve":
            assert scan.found is not None
            scan.parts[place] = result
            if len(scan.parts) == scan.found.blocks:
                self.submit(scan, "finish")
        else:
            self.keep(scan, result)

    def keep(self, scan: _Scan, done: Done) -> None:
        try:
            self.catalogue.keep(scan.source, done)
        except InputError as error:
            self.fail(scan, str(error))
            return
        scan.is_over = True
        scan.data = None
        self.fitted += 1
        self.wavelengths.update(done.statuses)

    def send(self, scan: _Scan, kind: str, place: int) -> None:
        """Send a file to the workers, once, and try again."""
        self.sending = True
        try:
            content = scan.source.file.read_bytes()
        except FileNotFoundError:
            self.fail(scan, f"{scan.source.path}: no such file")
            return
        except OSError as error:
            self.fail(scan, f"{scan.source.path}: cannot be read ({error.strerror})")
            return
        self.sent += len(content)
        scan.data = self.client.scatter(content, hash=False)
        self.submit(scan, kind, place)

    def fail(self, scan: _Scan, reason: str) -> None:
        scan.is_over = True
        scan.data = None
        self.failed[scan.source.path] = reason
        self.tell(reason if scan.source.path in reason else f"{scan.source.path}: {reason}")


def run_batch(
    client: Client,
    sources: Sequence[Source],
    catalogue: Catalogue,
    workers: int,
    *,
    bad: dict[str, str] | None = None,
    report: Report = silent,
    tell: Callable[[str], object] = str,
) -> Outcome:
    """Fit every scan that is not done, and write the index.

    Parameters
    ----------
    workers : int
        How many there are about; as many tasks as keep them busy are under way.
    bad : dict of str to str, optional
        Workers that are known not to be able to take part, and why.
    report : callable
        Called with (scans that are over, scans in all).
    tell : callable
        Called with a line on every scan and worker that fails, at once.

    Raises
    ------
    ClbrdfError
        The scheduler has gone.
    """
    from distributed import as_completed

    batch = _Batch(client, catalogue, workers, tell, dict(bad or {}), as_completed(loop=client.loop))
    waiting = deque(_Scan(source) for source in sources)
    report(0, len(sources))
    while waiting or batch.under_way:
        while waiting and len(batch.under_way) < AHEAD * max(1, workers):
            scan = waiting.popleft()
            if batch.sending:
                batch.send(scan, "look", 0)
            else:
                batch.submit(scan, "look")
        if not batch.under_way:
            continue
        try:
            batch.take(batch.next())
        except (OSError, StopIteration) as error:
            raise _lost(client) from error
        report(batch.fitted + batch.kept + len(batch.failed), len(sources))
    try:
        catalogue.write_index()
    except InputError as error:  # what is fitted is whole; --resume writes the index
        batch.failed[str(catalogue.folder / INDEX)] = str(error)
        tell(str(error))
    return Outcome(batch.fitted, batch.kept, batch.failed, batch.wavelengths, batch.sent, batch.tasks)


def _lost(client: Client) -> ClbrdfError:
    address = getattr(client.scheduler, "address", "")
    return ClbrdfError(
        f"the scheduler {address} has gone; scans that are finished are kept: start it again and add --resume"
    )


def _words(error: BaseException) -> str:
    """Return what a user is told of a task that failed."""
    from distributed import KilledWorker

    if isinstance(error, KilledWorker):
        return "each worker that took it was lost; it may need more memory than a worker has"
    if isinstance(error, ClbrdfError | UnseenError):
        return str(error)
    if isinstance(error, UnfitWorkerError):
        return f"no worker can take it; {error.args[0]}: {error.args[1]}"
    return f"cannot be fitted ({type(error).__name__}: {' '.join(str(error).split())})"
