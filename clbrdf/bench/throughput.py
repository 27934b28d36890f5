"""Million model evaluations a second: our kernels, their ceiling, NumPy, Numba and C, in one run."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clbrdf.bench.peers.c_peer import c_objective
from clbrdf.bench.peers.numba_peer import numba_objective
from clbrdf.bench.peers.numpy_peer import numpy_objective
from clbrdf.bench.workload import workload
from clbrdf.fit.objectives import prepare_objective
from clbrdf.fit.problem import Problem
from clbrdf.models import get_model
from clbrdf.opencl.device import Device, open_queue
from clbrdf.opencl.lanes import Lanes, lanes_of
from clbrdf.opencl.precision import PRECISIONS, Precision, get_precision
from clbrdf.opencl.program import Variant, build
from clbrdf.parallel.children import follow_parent, run_child
from clbrdf.parallel.ending import scratch_folder
from clbrdf.progress import Report, silent

Array = npt.NDArray[np.float64]
Run = Callable[[], object]

ROUNDS = 15
CEILING_COUNT = 4096
MODEL_SETS = 32768
"""Parameter sets of the workload where models are compared; so many that the launch does not count."""


@dataclass(frozen=True)
class Contender:
    """One way to do the work.

    Attributes
    ----------
    name, group : str
        What it is; "fp32" or "fp64".
    evaluations : int
        Model evaluations of one run.
    run : callable
    seconds : tuple of float
        Wall times, one a round.
    """

    name: str
    group: str
    evaluations: int
    run: Run
    seconds: tuple[float, ...] = ()

    @property
    def rate(self) -> float:
        """Median rate, million evaluations a second."""
        return self.evaluations / float(np.median(self.seconds)) / 1e6


def race(contenders: list[Contender], rounds: int | None = None, report: Report = silent) -> list[Contender]:
    """Run all in turn, round after round, so that a machine that slows down slows all of them.

    A first run of each, not timed, wakes the cores that the one before left idle.
    """
    times: list[list[float]] = [[] for _ in contenders]
    rounds = rounds or ROUNDS
    for done in range(rounds):
        for place, contender in enumerate(contenders):
            contender.run()
            start = time.perf_counter()
            contender.run()
            times[place].append(time.perf_counter() - start)
        report(done + 1, rounds)
    return [
        Contender(c.name, c.group, c.evaluations, c.run, tuple(t))
        for c, t in zip(contenders, times, strict=True)
    ]


def contenders_on(device: Device, folder: Path) -> list[Contender]:
    """Return all ways to compute E of the workload that this machine has; compilers write to a folder."""
    problem, sets = workload(device)
    evaluations = problem.size[1] * sets.shape[1]
    few = sets[:, :1024]
    out = []
    for group, dtype in (("fp32", np.float32), ("fp64", np.float64)):
        if group == "fp64" and not device.has_double:
            continue
        lanes = lanes_of(device, dtype)
        names = [p.name for p in PRECISIONS.values() if p.dtype is dtype]
        for name in names:
            launch, _ = prepare_objective(problem, sets, get_precision(name))
            out.append(Contender(f"OpenCL {name}, {lanes}", group, evaluations, launch))
        ceiling = ceiling_run(device, get_precision(names[-1]), lanes, problem)
        out.append(Contender(f"ceiling, {lanes}", group, *ceiling))
        for name, peer in (
            ("C, -O3 -march=native -ffast-math -fopenmp", c_objective(problem, sets[0], dtype, folder)),
            ("Numba, parallel, fastmath", numba_objective(problem, sets[0], dtype)),
        ):
            if peer is not None:
                out.append(Contender(name, group, evaluations, peer))
        slow = numpy_objective(problem, few[0], dtype)
        out.append(Contender("NumPy, one thread", group, problem.size[1] * few.shape[1], slow))
    return out


def model_contenders(name: str, device: Device, folder: Path) -> list[Contender]:
    """Return E of the workload with one model, on the device and in C, in single and double precision."""
    problem, sets = workload(device, MODEL_SETS, get_model(name))
    out = []
    for group, dtype, precision in (("fp32", np.float32, "fast:6"), ("fp64", np.float64, "double")):
        if group == "fp64" and not device.has_double:
            continue
        evaluations = problem.size[1] * sets.shape[1]
        launch, _ = prepare_objective(problem, sets, get_precision(precision))
        out.append(Contender(f"OpenCL {name}", group, evaluations, launch))
        peer = c_objective(problem, sets[0], dtype, folder)
        if peer is not None:
            out.append(Contender(f"C {name}", group, evaluations, peer))
    return out


def ceiling_run(device: Device, precision: Precision, lanes: Lanes, problem: Problem) -> tuple[int, Run]:
    """Return evaluations and run of the bare exp2 and multiply-add kernel."""
    import pyopencl as cl

    variant = Variant("ceiling", problem.model, precision, lanes)
    kernel, queue = cl.Kernel(build(device, variant), "ceiling"), open_queue(device)
    groups = 2048 // lanes.width if device.kind != "gpu" else 65536
    size = groups * lanes.width * np.dtype(precision.dtype).itemsize
    out = cl.Buffer(queue.context, cl.mem_flags.WRITE_ONLY, size)

    def run() -> None:
        kernel(queue, (groups,), None, np.uint32(CEILING_COUNT), precision.dtype(-0.5), out)
        queue.finish()

    return groups * lanes.width * CEILING_COUNT, run


@dataclass(frozen=True)
class Start:
    """Seconds before the first result: compilers' caches empty, then filled; and of one empty launch."""

    cold: float
    warm: float
    launch: float


def measure_start() -> Start:
    """Measure in fresh processes with caches of their own."""
    with scratch_folder() as folder:
        rows = [_start_in_child(folder) for _ in range(2)]
    return Start(rows[0]["first"], rows[1]["first"], rows[1]["launch"])


def _start_in_child(folder: Path) -> dict[str, float]:
    caches = {"POCL_CACHE_DIR": str(folder / "pocl"), "XDG_CACHE_HOME": str(folder / "xdg")}
    (folder / "pocl").mkdir(exist_ok=True)
    ended = run_child(["-c", "from clbrdf.bench.throughput import child; child()"], environment=caches)
    ended.check_returncode()
    row: dict[str, float] = json.loads(ended.stdout)
    return row


def child() -> None:
    """Print the seconds to the first values of the model, and the median of one-value evaluations."""
    follow_parent()
    from clbrdf.bench.workload import median_seconds
    from clbrdf.opencl.device import choose_device

    start = time.perf_counter()
    device = choose_device()
    problem, sets = workload(device, sets=8)
    prepare_objective(problem, sets, get_precision("single"))[0]()
    first = time.perf_counter() - start
    launch = median_seconds(ceiling_launch(device), repeats=201)
    print(json.dumps({"first": first, "launch": launch}))


def ceiling_launch(device: Device) -> Run:
    """Return a launch of one work item that does next to nothing."""
    import pyopencl as cl

    precision = get_precision("single")
    lanes = lanes_of(device, precision.dtype)
    variant = Variant("ceiling", get_model(), precision, lanes)
    kernel, queue = cl.Kernel(build(device, variant), "ceiling"), open_queue(device)
    out = cl.Buffer(queue.context, cl.mem_flags.WRITE_ONLY, 64 * lanes.width)

    def run() -> None:
        kernel(queue, (1,), None, np.uint32(0), precision.dtype(0.0), out)
        queue.finish()

    return run
