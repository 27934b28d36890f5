"""From a tolerance to the cheapest search that keeps it, as measured on wavelengths of the scan itself.

Some wavelengths, spread over the scan, are fitted with the usual settings of a method and by the dictionary,
of which the lower stands for the optimum, and with cheaper settings; those whose worst excess of E on them is
within a tenth of the tolerance qualify. The choice rests on excesses alone, which do not change from run to
run; the times are there to be read.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.fit.methods import Method, get_method
from clbrdf.fit.polish import EXACT
from clbrdf.fit.problem import Problem
from clbrdf.fit.solve import solve
from clbrdf.progress import silent

SAMPLE = 32
"""Wavelengths that are measured."""

MARGIN = 0.1
"""Share of the tolerance that the worst of the sample may use: the worst of a whole scan is higher."""

BEST = 1e-9
"""Excess of E that is rounding of the polish: no tolerance below it can be told apart."""


@dataclass(frozen=True)
class Rung:
    """One of a method's searches, measured.

    Attributes
    ----------
    words : str
    settings : object
        Of the method.
    excess : float
        Largest relative excess of E over the usual search.
    milliseconds : float
        A wavelength.
    """

    words: str
    settings: Any
    excess: float
    milliseconds: float

    def __str__(self) -> str:
        found = "E at the lowest" if self.excess == 0.0 else f"E within {self.excess:.1e}"
        return f"{self.words}: {found}, {self.milliseconds:.2g} ms a wavelength"


def choose_settings(problem: Problem, method: Method, seed: int, rtol: float) -> tuple[Rung, ...]:
    """Return the cheapest of a method's searches within a tolerance of E, and the next better one, if any.

    Parameters
    ----------
    problem : Problem
        Of the wavelengths to measure.
    method : Method
    seed : int
    rtol : float
        Largest relative excess of E.
    """
    rungs = measure_searches(problem, method, seed)
    place = next(k for k, rung in enumerate(rungs) if rung.excess <= MARGIN * rtol or k == len(rungs) - 1)
    better = [rung for rung in rungs[place + 1 :] if rung.excess < 0.5 * rungs[place].excess]
    return (rungs[place], *better[:1])


def measure_searches(problem: Problem, method: Method, seed: int) -> list[Rung]:
    """Measure a method's searches on a problem, the cheapest first, the usual one last."""
    searches = [*method.cheaper, ("usual search", method.settings())]
    energies, times = [], []
    given = {name for j, name in enumerate(problem.model.names) if j not in problem.free}
    best = get_method("auto", problem.model, None, given)  # chains are judged by the best method, too
    if best is not method:
        energies.append(solve(problem, best, best.settings(), seed, silent).objective)
    for _, settings in searches:
        for _ in range(2):  # the first one may compile
            start = time.perf_counter()
            solution = solve(problem, method, settings, seed, silent)
            seconds = time.perf_counter() - start
        energies.append(solution.objective)
        times.append(1e3 * seconds / problem.size[0])
    return [
        Rung(words, settings, excess(energy, energies), milliseconds)
        for (words, settings), energy, milliseconds in zip(
            searches, energies[-len(searches) :], times, strict=True
        )
    ]


def excess(energy: npt.NDArray[np.float64], energies: Sequence[npt.NDArray[np.float64]]) -> float:
    """Return the largest relative excess of E (W,) over the lowest of several."""
    lowest = np.min(energies, axis=0)
    relative = (energy - lowest) / np.maximum(lowest, EXACT)
    worst = float(np.where(energy <= EXACT, 0.0, relative).max())
    return 0.0 if worst <= 0.1 * BEST else worst
