"""A batch over 1, 2, … workers beside the same fits one after the other, and what a task costs by itself."""

from __future__ import annotations

import pickle
import time
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from clbrdf.batch.cluster import load_dask, local_cluster, look_at_workers
from clbrdf.batch.folder import open_catalogue
from clbrdf.batch.request import Request
from clbrdf.batch.run import AHEAD, run_batch
from clbrdf.batch.tasks import Done, Source, finish, look, solve_block
from clbrdf.bench.fit_race import race_scan
from clbrdf.models import DEFAULT_MODEL
from clbrdf.parallel.ending import scratch_folder
from clbrdf.parallel.executor import run_jobs
from clbrdf.parallel.processes import Processes
from clbrdf.progress import Report, silent
from clbrdf.scan import Scan
from clbrdf.storage.files import sha256

INCIDENT = 6
"""Incident angles of the scans: 774 directions."""

TASKS = 10_000
"""Of nothing, to see what one costs."""


@dataclass(frozen=True)
class BatchRun:
    """A batch of scans over some workers; 0 stands for one process with no Dask.

    Attributes
    ----------
    workers : int
    start : float
        Seconds until the workers were there, and had their kernels.
    seconds : float
        From the first task to the last file.
    same : bool
        Whether the files are those of the process without Dask, byte for byte.
    """

    workers: int
    start: float
    seconds: float
    same: bool


@dataclass(frozen=True)
class Sizes:
    """Bytes of a scan's file, of its solved blocks on their way, and of its fit's file; tasks it takes."""

    scan: int
    parts: int
    fit: int
    tasks: int


def bench_request() -> Request:
    """Return the usual fit of the default model."""
    return Request(
        model=DEFAULT_MODEL,
        method="auto",
        weights="none",
        seed=0,
        bounds={},
        fix={},
        shared=(),
        smooth=None,
        rtol=None,
        force=False,
    )


def write_scans(folder: Path, count: int, wavelengths: int) -> list[Source]:
    """Write scans that differ by their noise; return them as sources of a batch."""
    first = race_scan(INCIDENT, wavelengths)
    sources = []
    for k in range(count):
        noise = 1.0 + 0.01 * np.random.default_rng(k).standard_normal(first.brdf.shape)
        path = folder / f"scan{k:05d}.h5"
        replace(first, brdf=first.brdf * noise, sample=f"foil {k}").save(path)
        sources.append(Source(str(path), path.stem))
    return sources


def measure_workers(
    counts: Sequence[int], scans: int, wavelengths: int, report: Report = silent
) -> tuple[list[BatchRun], Sizes]:
    """Run the same batch in one process without Dask, and over each number of workers."""
    load_dask()
    total = scans * (1 + len(counts))
    with scratch_folder() as folder:
        (folder / "scans").mkdir()
        sources = write_scans(folder / "scans", scans, wavelengths)
        request = bench_request()
        alone, hashes = _alone(sources, request, folder / "alone", lambda done, _: report(done, total))
        runs = [alone]
        for k, count in enumerate(counts):
            before = scans * (1 + k)

            def further(done: int, _: int, before: int = before) -> None:
                report(before + done, total)

            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                runs.append(_over_workers(count, sources, folder / f"over{count}", hashes, further))
        return runs, _sizes(sources[0], request, folder / "alone")


def measure_tasks(workers: int, tasks: int = TASKS, report: Report = silent) -> tuple[float, float]:
    """Return what a task of nothing takes, of so many over some workers: seconds, and of the processor.

    The latter is of this process, in which client and scheduler are. Tasks are handed out as a batch hands
    out its own: some for each worker at a time.
    """
    from distributed import as_completed

    load_dask()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with local_cluster(workers) as client:
            look_at_workers(client, bench_request().version)
            queue, begun, busy = as_completed(), time.perf_counter(), time.process_time()
            for k in range(min(tasks, AHEAD * workers)):
                queue.add(client.submit(nothing, k, pure=False))
            given = min(tasks, AHEAD * workers)
            for done, _ in enumerate(queue):
                if given < tasks:
                    queue.add(client.submit(nothing, given, pure=False))
                    given += 1
                if done % 100 == 0:
                    report(done, tasks)
            return (time.perf_counter() - begun) / tasks, (time.process_time() - busy) / tasks


def nothing(k: int) -> int:
    """Do nothing."""
    return k


def _alone(
    sources: Sequence[Source], request: Request, folder: Path, report: Report
) -> tuple[BatchRun, dict[str, str]]:
    begun = time.perf_counter()
    with open_catalogue(folder, request, resume=False) as catalogue, Processes(1) as pool:
        run_jobs(pool, _warm, [(sources[0], request)], 1)
        ready = time.perf_counter()
        jobs = [(source, request, str(catalogue.folder)) for source in sources]
        for source, done in zip(sources, pool.map(_whole, jobs), strict=True):
            catalogue.keep(source, done)
            report(int(source.stem[4:]) + 1, len(sources))
        catalogue.write_index()
        seconds = time.perf_counter() - ready
    return BatchRun(0, ready - begun, seconds, True), _hashes(folder)


def _whole(job: tuple[Source, Request, str]) -> Done:
    """Do all tasks of a scan in this process, one after the other."""
    source, request, folder = job
    found = look(source, None, request)
    parts = [solve_block(source, None, request, found.sha256, k) for k in range(found.blocks)]
    return finish(source, None, request, found.sha256, parts, folder)


def warm(source: Source, request: Request) -> None:
    """Build the kernels of a fit in this process."""
    scan = Scan.open(source.path)
    request.fit(scan.columns(np.arange(min(8, len(scan.wavelength)))))


def _warm(job: tuple[Source, Request]) -> None:
    warm(*job)


def _over_workers(
    count: int, sources: Sequence[Source], folder: Path, hashes: dict[str, str], report: Report
) -> BatchRun:
    begun = time.perf_counter()
    request = bench_request()
    with open_catalogue(folder, request, resume=False) as catalogue, local_cluster(count) as client:
        look_at_workers(client, request.version)
        client.run(warm, sources[0], request)
        ready = time.perf_counter()
        run_batch(client, sources, catalogue, count, report=report)
        seconds = time.perf_counter() - ready
    return BatchRun(count, ready - begun, seconds, _hashes(folder) == hashes)


def _hashes(folder: Path) -> dict[str, str]:
    return {path.name: sha256(path) for path in folder.glob("*.h5")}


def _sizes(source: Source, request: Request, folder: Path) -> Sizes:
    found = look(source, None, request)
    parts = [solve_block(source, None, request, found.sha256, k) for k in range(found.blocks)]
    return Sizes(
        scan=source.file.stat().st_size,
        parts=len(pickle.dumps(parts)),
        fit=(folder / f"{source.stem}.h5").stat().st_size,
        tasks=found.blocks + 2,
    )
