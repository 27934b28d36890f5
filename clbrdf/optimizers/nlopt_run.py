"""How the adaptors call nlopt.

nlopt ends a run through `force_stop`, asked for when the recorder has finished: exceptions through its C++
code lose the best point, and some of its algorithms swallow them. Tolerances of the global algorithms stay
off, so that only budget and target end a run. Its generator of random numbers belongs to the thread and is
seeded here, just before the run.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.optimizers.objective import HUGE
from clbrdf.optimizers.trace import Finished, Recorder

Array = npt.NDArray[np.float64]


def run_nlopt(recorder: Recorder, seed: int, algorithm: str, local: str | None = None) -> None:
    """Run an algorithm of nlopt from a random start until the recorder has finished or it ends by itself.

    Parameters
    ----------
    recorder : Recorder
    seed : int
        Of nlopt's random numbers and of the start.
    algorithm, local : str
        Names in nlopt; `local` is the solver of MLSL.
    """
    import nlopt

    parameters = len(recorder.lower)
    nlopt.srand(seed + 1)  # 0 would mean the clock
    solver = nlopt.opt(getattr(nlopt, algorithm), parameters)

    def objective(q: Array, gradient: Array) -> float:
        try:
            if gradient.size == 0:
                return recorder.value(q)
            E, gradient[:] = recorder.value_and_gradient(q)
        except Finished:
            solver.force_stop()
            gradient[:] = 0.0
            return HUGE
        return E

    solver.set_lower_bounds(recorder.lower)
    solver.set_upper_bounds(recorder.upper)
    solver.set_min_objective(objective)
    solver.set_maxeval(recorder.left + 1)
    if local is not None:
        solver.set_local_optimizer(_local_solver(nlopt, local, parameters))
    start = np.random.default_rng(seed).uniform(recorder.lower, recorder.upper)
    try:
        solver.optimize(start)
    except (nlopt.ForcedStop, nlopt.RoundoffLimited, getattr(nlopt, "runtime_error", RuntimeError)):
        # The recorder has the best point; a local solver that finds no lower point ends MLSL as a failure.
        return


LOCAL_FTOL = 1e-10
"""Relative change of E that ends a local search: below the smallest gap that benchmarks ask for, 1e-8."""

LOCAL_XTOL = 1e-9
LOCAL_EVALUATIONS = 500


def _local_solver(nlopt: Any, name: str, parameters: int) -> Any:
    solver = nlopt.opt(getattr(nlopt, name), parameters)
    solver.set_ftol_rel(LOCAL_FTOL)
    solver.set_xtol_rel(LOCAL_XTOL)
    solver.set_maxeval(LOCAL_EVALUATIONS)
    return solver
