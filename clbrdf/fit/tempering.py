"""Replica exchange: chains at fixed temperatures swap states, so that cold ones are fed by warm ones.

The rules are told in kernels/tempering.cl.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clbrdf.errors import InputError
from clbrdf.fit.chains import Chains
from clbrdf.fit.polish import check_polish
from clbrdf.fit.problem import Candidates, Problem
from clbrdf.precision import get_precision
from clbrdf.progress import Report


@dataclass(frozen=True)
class TemperingSettings:
    """Ladders of temperatures and how long to climb them.

    Attributes
    ----------
    ladders : int
        Ladders a wavelength.
    rungs : int
        Chains a ladder, each at a temperature of its own.
    hottest, coldest : float
        Ends of a ladder, in units of ln E; between, temperatures are in geometric progression.
    rounds : int
        Exchanges between neighbours.
    sweeps : int
        Steps in each coordinate between two exchanges.
    starts : int
        Best chains that go on to the polish.
    precision : str
        Arithmetic of the chains (clbrdf.precision).
    polish : "none", "single" or "double"
        How far the ends are polished; the usual way is to the last digit in double precision.
    """

    ladders: int = 4
    rungs: int = 16
    hottest: float = 1.0
    coldest: float = 0.003
    rounds: int = 60
    sweeps: int = 4
    starts: int = 8
    precision: str = "single"
    polish: str = "double"

    def __post_init__(self) -> None:
        check_polish(self.polish)
        for name in ("ladders", "rungs", "rounds", "sweeps", "starts"):
            if not 1 <= getattr(self, name) <= 1_000_000:
                raise InputError(f"{name} is {getattr(self, name)}; give 1 to 1000000")
        get_precision(self.precision)
        if not 0.0 < self.coldest < self.hottest:
            raise InputError("temperatures have to satisfy 0 < coldest < hottest")

    def cost(self, directions: int, parameters: int) -> tuple[int, int]:
        """Return bytes, and model evaluations of the longest launch, that one wavelength takes."""
        chains = self.ladders * self.rungs
        return 24 * directions + 256 * chains, directions * chains * self.sweeps * parameters

    def deeper(self) -> None:
        """Return None: there is no second look."""
        return


def search(problem: Problem, settings: TemperingSettings, seed: int, report: Report) -> Candidates:
    """Exchange replicas at every wavelength of a problem; return the best states of the best chains.

    Raises
    ------
    DeviceError
        The device cannot build or run the kernels.
    """
    count = settings.ladders * settings.rungs
    separable = problem.model.structure is not None
    chains = Chains(problem, "tempering", count, settings.precision, seed, separable)
    rungs, groups = np.uint32(settings.rungs), np.uint32(chains.groups)
    ratio = (settings.coldest / settings.hottest) ** (1.0 / max(1, settings.rungs - 1))
    chains.launch("tempering_start", chains.dtype(settings.hottest), chains.dtype(ratio), rungs)
    q, _, _, energy, _, temperature, _ = chains.state
    for k in range(settings.rounds):
        chains.launch("tempering_sweeps", np.uint32(k), np.uint32(settings.sweeps))
        chains.launch_bare(
            "tempering_exchange",
            (settings.ladders, chains.w),
            *(np.uint64(seed), chains.keys, np.uint32(k), rungs, groups, q, energy, temperature),
        )
        report(k + 1, settings.rounds)
    return chains.candidates(settings.starts, settings.rounds * settings.sweeps * chains.searched)
