"""Simulated annealing, many chains a wavelength in parallel.

Of all parameters, as in the paper, or of those alone that do not enter linearly.

The rules of the chains (steps, cooling, random numbers) are told in kernels/anneal.cl. A level is one
launch, so that progress shows and Ctrl-C is heard between launches.
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
        Arithmetic of the chains (clbrdf.precision).
    polish : "none", "single" or "double"
        How far the ends are polished; the usual way is to the last digit in double precision.
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
    polish: str = "double"

    def __post_init__(self) -> None:
        check_polish(self.polish)
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
    """Anneal every wavelength of a problem in all coordinates; return the best states of the best chains.

    Raises
    ------
    DeviceError
        The device cannot build or run the kernels.
    """
    return _anneal(problem, settings, seed, report, separable=False)


def search_separable(problem: Problem, settings: Settings, seed: int, report: Report) -> Candidates:
    """Anneal in the coordinates that do not enter linearly, the linear ones solved at each step.

    Raises
    ------
    DeviceError
        The device cannot build or run the kernels.
    """
    return _anneal(problem, settings, seed, report, separable=True)


def _anneal(problem: Problem, settings: Settings, seed: int, report: Report, separable: bool) -> Candidates:
    chains = Chains(problem, "anneal", settings.chains, settings.precision, seed, separable)
    real = chains.dtype
    chains.launch("anneal_start", real(settings.temperature))
    rules = [real(rule) for rule in (settings.cooling, settings.slowest, settings.fastest)]
    for level in range(settings.levels):
        chains.launch("anneal_level", np.uint32(level), np.uint32(settings.sweeps), *rules)
        report(level + 1, settings.levels)
    return chains.candidates(settings.starts, settings.levels * settings.sweeps * chains.searched)
