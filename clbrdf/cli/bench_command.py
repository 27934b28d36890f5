"""`clbrdf bench`: measured here, now, beside peers."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Literal

from clbrdf.bench.throughput import Contender, Start, contenders_on, measure_start, race
from clbrdf.cli.console import print_table, progress_bar
from clbrdf.cli.options import DeviceName, JsonFile, Overwrite
from clbrdf.device import choose_device
from clbrdf.files import check_output, whole_text


def command(
    what: Literal["throughput"],
    /,
    *,
    device: DeviceName = None,
    json: JsonFile = None,
    overwrite: Overwrite = False,
) -> None:
    """Measure on this machine, now, in one interleaved run.

    Parameters
    ----------
    what
        throughput: million model evaluations a second in E (13), beside NumPy, Numba and C
    """
    del what
    if json is not None:
        check_output(json, overwrite)
    chosen = choose_device(device)
    with tempfile.TemporaryDirectory() as folder, progress_bar("rounds") as report:
        rows = race(contenders_on(chosen, Path(folder)), report=report)
    start = measure_start()
    print(f"{chosen}, {chosen.compute_units} units\n")
    for group in ("fp32", "fp64"):
        _print_group(group, [row for row in rows if row.group == group])
    text = [[name, f"{seconds:.2g}"] for name, seconds in _starts(start)]
    print_table("Before the first result", ("", "seconds"), text)
    if json is not None:
        whole_text(json, _content(str(chosen), rows, start), overwrite)


def _starts(start: Start) -> list[tuple[str, float]]:
    return [("cold, caches empty", start.cold), ("warm", start.warm), ("one launch", start.launch)]


def _rate(rows: list[Contender], begin: str) -> float:
    return next((row.rate for row in rows if row.name.startswith(begin)), float("nan"))


def _print_group(group: str, rows: list[Contender]) -> None:
    if not rows:
        return
    c, ceiling = _rate(rows, "C,"), _rate(rows, "ceiling")
    text = [
        [
            row.name,
            f"{row.rate:.0f}",
            f"{row.rate / c:.2f}" if c == c else "–",
            f"{100 * row.rate / ceiling:.0f} %" if row.name.startswith("OpenCL") else "",
            f"{row.evaluations / min(row.seconds) / 1e6:.0f}",
        ]
        for row in rows
    ]
    print_table(
        f"E in {group}, million model evaluations a second", ("", "median", "× C", "ceiling", "best"), text
    )


def _content(device: str, rows: list[Contender], start: Start) -> dict[str, object]:
    return {
        "device": device,
        "start": {"cold": start.cold, "warm": start.warm, "launch": start.launch},
        "throughput": [
            {"name": row.name, "group": row.group, "rate": row.rate, "seconds": list(row.seconds)}
            for row in rows
        ],
    }
