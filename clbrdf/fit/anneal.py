"""Simulated annealing of all parameters, many chains a wavelength in parallel (the paper's method).

The rules of the chains (steps, cooling, random numbers) are told in kernels/anneal.cl. A level is one
launch, so that progress shows and Ctrl-C is heard between launches.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from clbrdf.device import open_queue
from clbrdf.errors import InputError
from clbrdf.fit.problem import Candidates, Problem
from clbrdf.precision import get_precision
from clbrdf.program import Variant, build, upload
from clbrdf.progress import Report


@dataclass(frozen=True)
class Settings:
    """How long and how carefully to anneal.

    Attributes
    ----------
    chains : int
        Chains a wavelength; rounded up to whole vectors of lanes.
    levels : int
        Temperature levels.
    sweeps : int
        Steps in each coordinate within a level.
    temperature : float
        At the start, in units of ln E.
    cooling : float
        λ of the cooling rule: larger is faster.
    slowest, fastest : float
        Limits of the factor by which a level cools; `slowest` bounds the last temperature from above.
    starts : int
        Best chains that go on to the polish.
    precision : str
        Arithmetic of the chains (clbrdf.precision); the polish is always double.
    """

    chains: int = 64
    levels: int = 30
    sweeps: int = 20
    temperature: float = 1.0
    cooling: float = 0.7
    slowest: float = 0.85
    fastest: float = 0.5
    starts: int = 8
    precision: str = "single"

    def __post_init__(self) -> None:
        for name in ("chains", "levels", "sweeps", "starts"):
            if not 1 <= getattr(self, name) <= 1_000_000:
                raise InputError(f"{name} is {getattr(self, name)}; give 1 to 1000000")
        get_precision(self.precision)
        if not 0.0 < self.fastest <= self.slowest < 1.0:
            raise InputError("cooling factors have to satisfy 0 < fastest ≤ slowest < 1")

    def cost(self, directions: int, parameters: int) -> tuple[int, int]:
        """Return bytes, and model evaluations of the longest launch, that one wavelength takes."""
        return 24 * directions + 256 * self.chains, directions * self.chains * self.sweeps * parameters

    def deeper(self) -> None:
        """Return None: there is no second look."""
        return


def search(problem: Problem, settings: Settings, seed: int, report: Report) -> Candidates:
    """Anneal every wavelength of a problem; return the best states of the best chains.

    Raises
    ------
    DeviceError
        The device cannot build or run the kernels.
    """
    import pyopencl as cl

    device, precision = problem.device, get_precision(settings.precision)
    dtype = precision.dtype
    library = ("philox", "random", "coordinates", "objective")
    variant = Variant.on(device, "anneal", problem.model, precision, library)
    program, queue = build(device, variant), open_queue(device)
    w, n = problem.size
    p, groups, width = len(problem.lower), -(-settings.chains // variant.lanes.width), variant.lanes.width

    def scratch(values: int, kind: type[np.generic]) -> Any:
        return cl.Buffer(queue.context, cl.mem_flags.READ_WRITE, max(1, values) * np.dtype(kind).itemsize)

    per_coordinate, per_chain = w * groups * p * width, w * groups * width
    q, best, step = (scratch(per_coordinate, dtype) for _ in range(3))
    energy, best_energy, temperature = (scratch(per_chain, dtype) for _ in range(3))
    counts = scratch(2 * per_chain, np.uint32)
    data = (
        *(upload(device, problem.features, dtype), upload(device, problem.starts)),
        *(np.uint32(len(problem.starts) - 1), np.uint32(n)),
        *(upload(device, values, dtype) for values in (problem.target, problem.scale)),
        *(upload(device, values, dtype) for values in (problem.lower, problem.upper)),
        *(np.uint64(seed), upload(device, problem.keys)),
    )
    state = (q, best, step, energy, best_energy, temperature, counts)
    cl.Kernel(program, "anneal_start")(queue, (groups, w), None, *data, dtype(settings.temperature), *state)
    level_kernel = cl.Kernel(program, "anneal_level")
    rules = [dtype(rule) for rule in (settings.cooling, settings.slowest, settings.fastest)]
    for level in range(settings.levels):
        level_kernel(
            queue, (groups, w), None, *data, np.uint32(level), np.uint32(settings.sweeps), *rules, *state
        )
        queue.finish()
        report(level + 1, settings.levels)

    host_best = np.empty((w, groups, p, width), dtype=dtype)
    host_energy = np.empty((w, groups, width), dtype=dtype)
    host_counts = np.empty((w, groups, 2, width), dtype=np.uint32)
    for host, buffer in ((host_best, best), (host_energy, best_energy), (host_counts, counts)):
        cl.enqueue_copy(queue, host, buffer)
    chains = host_best.transpose(0, 1, 3, 2).reshape(w, groups * width, p).astype(np.float64)
    energies = np.nan_to_num(host_energy.reshape(w, groups * width), nan=np.inf)
    order = np.argsort(energies, axis=1, kind="stable")[:, : settings.starts]
    moves = groups * width * settings.levels * settings.sweeps * p
    taken, not_finite = host_counts.sum(axis=(1, 3), dtype=np.int64).T
    return Candidates(
        coordinates=np.take_along_axis(chains, order[:, :, None], axis=1),
        evaluations=np.full(w, moves + groups * width, dtype=np.int64),
        acceptance=taken / moves,
        not_finite=not_finite,
        doubtful=np.zeros(w, dtype=np.bool_),
    )
