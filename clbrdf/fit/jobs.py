"""The blocks of a fit as jobs, which an `Executor` may run in other processes and on other machines."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.fit.methods import Method
from clbrdf.fit.problem import Problem
from clbrdf.fit.solve import Solution, solve
from clbrdf.opencl.device import device_here
from clbrdf.progress import silent


@dataclass(frozen=True, eq=False)
class Job:
    """One block of wavelengths, and how it is to be solved."""

    problem: Problem
    method: Method
    settings: Any
    seed: int


class Jobs:
    """The jobs of a fit in their order, each made when it is asked for.

    Parameters
    ----------
    blocks : sequence of (W,) int
        Places of the wavelengths.
    make : callable
        Returns the job of a block.
    """

    def __init__(
        self, blocks: Sequence[npt.NDArray[np.intp]], make: Callable[[npt.NDArray[np.intp]], Job]
    ) -> None:
        self.blocks, self.make = blocks, make

    def __len__(self) -> int:
        return len(self.blocks)

    def __getitem__(self, place: int) -> Job:
        return self.make(self.blocks[place])

    def __iter__(self) -> Iterator[Job]:
        return map(self.make, self.blocks)


def solve_job(job: Job) -> Solution:
    """Solve a block on the device of this process that is the one of the job.

    Raises
    ------
    DeviceError
        There is no such device here, or it cannot build or run the kernels.
    """
    problem = replace(job.problem, device=device_here(job.problem.device))
    return solve(problem, job.method, job.settings, job.seed, silent)
