"""Simulated annealing, many chains a wavelength in parallel.

Of all parameters, as in the paper, or of those alone that do not enter linearly.

The rules of the chains (steps, cooling, random numbers) are told in kernels/anneal.cl. A level is one
launch, so that progress shows and Ctrl-C is heard between launches.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clbrdf.errors import InputError
from clbrdf.fit import lookup
from clbrdf.fit.chains import Chains, ChainSettings, all_linear
from clbrdf.fit.lookup import LookupSettings
from clbrdf.fit.problem import Candidates, Problem
from clbrdf.progress import Report


@dataclass(frozen=True)
class AnnealSettings(ChainSettings):
    """How long and how carefully to anneal; the rest as of `ChainSettings`.

    Attributes
    ----------
    chains : int
        Chains a wavelength; rounded up to whole vectors of lanes.
    levels : int
        Temperature levels, of `sweeps` steps in each coordinate.
    temperature : float
        At the start, in units of ln E.
    cooling : float
        λ of the cooling rule: larger is faster.
    slowest, fastest : float
        Limits of the factor by which a level cools; `slowest` bounds the last temperature from above.
    """

    sweeps: int = 20
    chains: int = 64
    levels: int = 30
    temperature: float = 1.0
    cooling: float = 0.7
    slowest: float = 0.85
    fastest: float = 0.5

    def __post_init__(self) -> None:
        self.check("chains", "levels")
        if not 0.0 < self.fastest <= self.slowest < 1.0:
            raise InputError("cooling factors have to satisfy 0 < fastest ≤ slowest < 1")

    @property
    def all_chains(self) -> int:
        """Chains a wavelength."""
        return self.chains


def search(problem: Problem, settings: AnnealSettings, seed: int, report: Report) -> Candidates:
    """Anneal every wavelength of a problem in all coordinates; return the best states of the best chains.

    Raises
    ------
    DeviceError
        The device cannot build or run the kernels.
    """
    return _anneal(problem, settings, seed, report, separable=False)


def search_separable(problem: Problem, settings: AnnealSettings, seed: int, report: Report) -> Candidates:
    """Anneal in the coordinates that do not enter linearly, the linear ones solved at each step.

    Where all are linear, there is nothing to anneal, and they are solved at once.

    Raises
    ------
    DeviceError
        The device cannot build or run the kernels.
    """
    if all_linear(problem):
        return lookup.search(problem, LookupSettings(), seed, report)
    return _anneal(problem, settings, seed, report, separable=True)


def _anneal(
    problem: Problem, settings: AnnealSettings, seed: int, report: Report, separable: bool
) -> Candidates:
    chains = Chains(problem, "anneal", settings.chains, settings.precision, seed, separable)
    real = chains.dtype
    chains.launch("anneal_start", real(settings.temperature))
    rules = [real(rule) for rule in (settings.cooling, settings.slowest, settings.fastest)]
    for level in range(settings.levels):
        chains.launch("anneal_level", np.uint32(level), np.uint32(settings.sweeps), *rules)
        report(level + 1, settings.levels)
    return chains.candidates(settings.starts, settings.levels * settings.sweeps * chains.searched)
