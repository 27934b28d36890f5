"""Many Markov chains a wavelength on the device: their data, their state, and what they found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from clbrdf.errors import InputError
from clbrdf.fit.polish import check_polish
from clbrdf.fit.problem import Candidates, Problem
from clbrdf.opencl.device import open_queue
from clbrdf.opencl.precision import get_precision
from clbrdf.opencl.program import Variant, build, upload, work_group


@dataclass(frozen=True)
class ChainSettings:
    """What searches by chains have in common.

    Attributes
    ----------
    sweeps : int
        Steps in each coordinate of a launch.
    starts : int
        Best chains that go on to the polish.
    precision : str
        Arithmetic of the chains (clbrdf.opencl.precision).
    polish : "none", "single" or "double"
        How far the ends are polished; the usual way is to the last digit in double precision.
    """

    sweeps: int
    starts: int = 8
    precision: str = "fast:6"
    polish: str = "double"

    @property
    def all_chains(self) -> int:
        """Chains a wavelength."""
        raise NotImplementedError

    def check(self, *counts: str) -> None:
        """Raise InputError where a named count is out of range, or precision or polish unknown."""
        check_polish(self.polish)
        get_precision(self.precision)
        for name in (*counts, "sweeps", "starts"):
            if not 1 <= getattr(self, name) <= 1_000_000:
                raise InputError(f"{name} is {getattr(self, name)}; give 1 to 1000000")

    def cost(self, directions: int, parameters: int) -> tuple[int, int]:
        """Return bytes, and model evaluations of the longest launch, that one wavelength takes."""
        chains = self.all_chains
        return 24 * directions + 256 * chains, directions * chains * self.sweeps * parameters

    def deeper(self) -> None:
        """Return None: there is no second look."""
        return


def free_linear(problem: Problem) -> tuple[int, ...]:
    """Places of the linear parameters that are not given."""
    return tuple(j for j in problem.model.linear if j in problem.free)


def all_linear(problem: Problem) -> bool:
    """Whether every parameter that is not given is linear, so that nothing is left to search."""
    return len(free_linear(problem)) == len(problem.free)


def search_library(separable: bool) -> tuple[str, ...]:
    """Files of kernels/lib that say which coordinates a search moves in."""
    return ("box", "search_separable") if separable else ("search_all",)


class Chains:
    """Chains of one problem; kernels/lib/chain.cl tells their rules and the layout of their state.

    Parameters
    ----------
    problem : Problem
    job : str
        Kernel file that moves the chains.
    count : int
        Chains a wavelength; rounded up to whole vectors of lanes.
    precision : str
    seed : int
    separable : bool
        Solve the linear parameters at each step instead of searching them.

    Raises
    ------
    DeviceError
        The device cannot build the kernels.
    """

    def __init__(
        self, problem: Problem, job: str, count: int, precision: str, seed: int, separable: bool
    ) -> None:
        import pyopencl as cl

        device, chosen = problem.device, get_precision(precision)
        library = ("philox", "random", "coordinates", "objective", *search_library(separable), "chain")
        variant = Variant.on(device, job, problem.model, chosen, library, free=problem.free)
        self.dtype, self.width = chosen.dtype, variant.lanes.width
        self.queue, self._program = open_queue(device), build(device, variant)
        self._local = work_group(device, 2)
        self.w, n = problem.size
        self.p, self.groups = problem.lower.shape[1], -(-count // self.width)
        self.searched = len(problem.free) - (len(free_linear(problem)) if separable else 0)

        def scratch(values: int, kind: type[np.generic]) -> Any:
            size = max(1, values) * np.dtype(kind).itemsize
            return cl.Buffer(self.queue.context, cl.mem_flags.READ_WRITE, size)

        per_coordinate = self.w * self.groups * self.p * self.width
        per_chain = self.w * self.groups * self.width
        q, best, step = (scratch(per_coordinate, self.dtype) for _ in range(3))
        energy, best_energy, temperature = (scratch(per_chain, self.dtype) for _ in range(3))
        self.state = (q, best, step, energy, best_energy, temperature, scratch(2 * per_chain, np.uint32))
        self.keys = upload(device, problem.keys)
        self._data = (
            *(upload(device, problem.features, self.dtype), upload(device, problem.starts)),
            *(np.uint32(len(problem.starts) - 1), np.uint32(n)),
            *(upload(device, values, self.dtype) for values in (problem.target, problem.scale)),
            *(upload(device, values, self.dtype) for values in (problem.lower, problem.upper)),
            *(np.uint64(seed), self.keys),
        )

    @property
    def count(self) -> int:
        """Chains a wavelength."""
        return self.groups * self.width

    def launch(self, kernel: str, *arguments: Any) -> None:
        """Run a kernel over all chains and wait, so that Ctrl-C is heard between launches."""
        import pyopencl as cl

        size = (self.groups, self.w)
        cl.Kernel(self._program, kernel)(self.queue, size, self._local, *self._data, *arguments, *self.state)
        self.queue.finish()

    def launch_bare(self, kernel: str, size: tuple[int, int], *arguments: Any) -> None:
        """Run a kernel with arguments of its own."""
        import pyopencl as cl

        cl.Kernel(self._program, kernel)(self.queue, size, self._local, *arguments)

    def candidates(self, starts: int, steps: int) -> Candidates:
        """Return the best states of the best chains, after so many steps of each chain."""
        import pyopencl as cl

        _, best, _, _, best_energy, _, counts = self.state
        host_best = np.empty((self.w, self.groups, self.p, self.width), dtype=self.dtype)
        host_energy = np.empty((self.w, self.groups, self.width), dtype=self.dtype)
        host_counts = np.empty((self.w, self.groups, 2, self.width), dtype=np.uint32)
        for host, buffer in ((host_best, best), (host_energy, best_energy), (host_counts, counts)):
            cl.enqueue_copy(self.queue, host, buffer)
        ends = host_best.transpose(0, 1, 3, 2).reshape(self.w, self.count, self.p).astype(np.float64)
        energies = np.nan_to_num(host_energy.reshape(self.w, self.count), nan=np.inf)
        order = np.argsort(energies, axis=1, kind="stable")[:, :starts]
        taken, not_finite = host_counts.sum(axis=(1, 3), dtype=np.int64).T
        return Candidates(
            coordinates=np.take_along_axis(ends, order[:, :, None], axis=1),
            evaluations=np.full(self.w, self.count * (steps + 1), dtype=np.int64),
            acceptance=taken / (self.count * steps),
            not_finite=not_finite,
            doubtful=np.zeros(self.w, dtype=np.bool_),
        )
