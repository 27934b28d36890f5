"""The fastest lanes of a device, found by building and timing each width in a child process.

Some compilers crash or hang on wide vectors. A child with a time limit turns that into a line of the
table, and the program goes on with the widths that work.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from clbrdf.bench.workload import objective_rate
from clbrdf.errors import DeviceError
from clbrdf.opencl.device import Device, choose_device
from clbrdf.opencl.lanes import Lanes, keep_answers
from clbrdf.opencl.precision import get_precision
from clbrdf.parallel.children import follow_parent, run_child
from clbrdf.progress import Report, silent

WIDTHS = {"float32": (4, 8, 16), "float64": (2, 4, 8)}
UNROLLS = (1, 2, 4, 8, 12, 16)
SECONDS = 20.0
"""Time limit of a child, which builds and times one width with every unrolling."""

PRECISION = {"float32": "single", "float64": "double"}


@dataclass(frozen=True)
class Trial:
    """One candidate: its rate in million model evaluations a second, 0 where it failed, and then why."""

    dtype: str
    lanes: Lanes
    rate: float
    failure: str = ""


def tune(device: Device, report: Report = silent, seconds: float = SECONDS) -> tuple[list[Trial], Path]:
    """Time all candidates on a device and keep the fastest of each type; return trials and the file.

    Raises
    ------
    DeviceError
        Not even the safe lanes work.
    """
    kinds = [kind for kind in WIDTHS if kind == "float32" or device.has_double]
    jobs = [(kind, width) for kind in kinds for width in _widths(device, kind)]
    trials: list[Trial] = []
    for k, (kind, width) in enumerate(jobs):
        trials += try_width(device, kind, width, seconds)
        report(k + 1, len(jobs))
    answers = {}
    for kind in kinds:
        working = [t for t in trials if t.dtype == kind and not t.failure]
        if not working:
            raise DeviceError(f"{device}: no vector width of {kind} works; use another device")
        answers[kind] = max(working, key=lambda t: t.rate).lanes
    return trials, keep_answers(device, answers)


def _widths(device: Device, kind: str) -> Sequence[int]:
    return (1,) if device.kind == "gpu" else WIDTHS[kind]


def try_width(device: Device, kind: str, width: int, seconds: float = SECONDS) -> list[Trial]:
    """Build and time one width with every unrolling in a child process."""
    job = json.dumps({"device": asdict(device), "dtype": kind, "width": width})
    try:
        ended = run_child(["-m", "clbrdf.bench.tune", job], timeout=seconds)
        output, code = ended.stdout, ended.returncode
        failure = "" if code == 0 else f"crashed ({_cause(code)})"
    except subprocess.TimeoutExpired as expired:
        output = expired.stdout.decode() if isinstance(expired.stdout, bytes) else (expired.stdout or "")
        failure = f"no answer in {seconds:.0f} s"
    rates = {int(row["unroll"]): float(row["rate"]) for row in map(json.loads, output.splitlines())}
    return [
        Trial(kind, Lanes(width, unroll), rates.get(unroll, 0.0), "" if unroll in rates else failure)
        for unroll in UNROLLS
    ]


def _cause(code: int) -> str:
    import signal

    return signal.Signals(-code).name if code < 0 else f"exit status {code}"


def child(job: str) -> None:
    """Time one width; print a line of JSON for each unrolling as soon as it is known."""
    content = json.loads(job)
    wanted = Device(**{**content["device"], "index": tuple(content["device"]["index"])})
    device = choose_device(wanted.name)
    precision = get_precision(PRECISION[content["dtype"]])
    for unroll in UNROLLS:
        rate = objective_rate(device, precision, Lanes(content["width"], unroll))
        print(json.dumps({"unroll": unroll, "rate": rate}), flush=True)


if __name__ == "__main__":
    follow_parent()
    child(sys.argv[1])
