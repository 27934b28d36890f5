"""Replica exchange: chains at fixed temperatures swap states, so that cold ones are fed by warm ones.

The rules are told in kernels/tempering.cl.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clbrdf.errors import InputError
from clbrdf.fit import lookup
from clbrdf.fit.chains import Chains, ChainSettings, all_linear, free_linear
from clbrdf.fit.lookup import LookupSettings
from clbrdf.fit.problem import Candidates, Problem
from clbrdf.progress import Report


@dataclass(frozen=True)
class TemperingSettings(ChainSettings):
    """Ladders of temperatures and how long to climb them; the rest as of `ChainSettings`.

    Attributes
    ----------
    ladders : int
        Ladders a wavelength.
    rungs : int
        Chains a ladder, each at a temperature of its own.
    hottest, coldest : float
        Ends of a ladder, in units of ln E; between, temperatures are in geometric progression.
    rounds : int
        Exchanges between neighbours, with `sweeps` steps in each coordinate between two.
    """

    sweeps: int = 4
    ladders: int = 4
    rungs: int = 16
    hottest: float = 1.0
    coldest: float = 0.003
    rounds: int = 60

    def __post_init__(self) -> None:
        self.check("ladders", "rungs", "rounds")
        if not 0.0 < self.coldest < self.hottest:
            raise InputError("temperatures have to satisfy 0 < coldest < hottest")

    @property
    def all_chains(self) -> int:
        """Chains a wavelength."""
        return self.ladders * self.rungs


def search(problem: Problem, settings: TemperingSettings, seed: int, report: Report) -> Candidates:
    """Exchange replicas at every wavelength of a problem; return the best states of the best chains.

    Where all parameters are linear, there is nothing to search, and they are solved at once.

    Raises
    ------
    DeviceError
        The device cannot build or run the kernels.
    """
    if all_linear(problem):
        return lookup.search(problem, LookupSettings(), seed, report)
    separable = bool(free_linear(problem))
    chains = Chains(problem, "tempering", settings.all_chains, settings.precision, seed, separable)
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
