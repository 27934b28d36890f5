"""`clbrdf bench batch`: a batch over 1, 2, … workers, and what a task costs."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from clbrdf.bench.batch import TASKS, measure_tasks, measure_workers
from clbrdf.cli.console import print_table, progress_bar
from clbrdf.errors import InputError
from clbrdf.parallel.executor import usable_cores

SCANS, WAVELENGTHS = 64, 256


def bench_batch(
    scans: int | None = None, wavelengths: int | None = None, tasks: int = TASKS
) -> dict[str, Any]:
    """Fit scans over 1, 2, … up to as many workers as cores; print two tables, return all numbers.

    Raises
    ------
    InputError
        Fewer scans or wavelengths than 1.
    """
    scans = SCANS if scans is None else scans
    wavelengths = WAVELENGTHS if wavelengths is None else wavelengths
    if min(scans, wavelengths) < 1:
        raise InputError(f"{scans} scans of {wavelengths} wavelengths: give 1 or more of each")
    most = usable_cores()
    counts = sorted({1, *(n for n in (2, 4, 8, 16, 32, 64) if n < most), most})
    with progress_bar("scans") as report:
        runs, sizes = measure_workers(counts, scans, wavelengths, report)
    with progress_bar("tasks of nothing") as report:
        each, busy = measure_tasks(most, tasks, report)
    alone = runs[0].seconds
    rows = [
        [
            _name(run.workers),
            f"{run.start:.1f}",
            f"{run.seconds:.1f}",
            f"{1e3 * run.seconds / (scans * wavelengths):.2f}",
            f"{alone / (max(run.workers, 1) * run.seconds):.0%}",
            "yes" if run.same else "NO",
        ]
        for run in runs
    ]
    heads = ("", "start s", "seconds", "ms a wavelength", "efficiency", "same bytes")
    print_table(f"{scans} scans of {wavelengths} wavelengths × 774 directions, on {most} cores", heads, rows)
    facts = [
        ["tasks a scan", str(sizes.tasks)],
        ["bytes of a scan", f"{sizes.scan:,}"],
        ["bytes of its solved blocks, through the client", f"{sizes.parts:,}"],
        ["bytes of its fit", f"{sizes.fit:,}"],
        [f"ms a task of nothing, of {tasks:,}", f"{1e3 * each:.2f}"],
        ["  of them client and scheduler at work", f"{1e3 * busy:.2f}"],
    ]
    print_table("What moves, and what a task costs", ("", "measured"), facts)
    return {
        "runs": [asdict(run) for run in runs],
        "sizes": asdict(sizes),
        "task_seconds": each,
        "task_busy_seconds": busy,
        "scans": scans,
        "wavelengths": wavelengths,
    }


def _name(workers: int) -> str:
    if workers == 0:
        return "one process, no Dask"
    return "1 worker" if workers == 1 else f"{workers} workers"
