"""Global optimizers of others behind one protocol: the same objective, limits, budget, seeds and record.

    trace = minimise("mlsl-lbfgs", objective, evaluations=4000, seed=0)

`objective` is E of (13) at one wavelength, in NumPy or on the device.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from clbrdf.errors import InputError
from clbrdf.optimizers import (
    ags,
    annealing,
    crs2,
    direct,
    esch,
    evolution,
    homology,
    isres,
    mlsl,
    multi_start,
    random_search,
    stogo,
)
from clbrdf.optimizers.objective import Values
from clbrdf.optimizers.trace import Recorder, Trace

__all__ = ["OPTIMIZERS", "Optimizer", "Trace", "minimise"]


@dataclass(frozen=True)
class Optimizer:
    """One optimizer.

    Attributes
    ----------
    name, title : str
        As it is asked for, and as it is printed.
    run : callable
        (Recorder, seed): works until the recorder raises Finished, or ends by itself.
    gradient : bool
        Whether it uses derivatives.
    random : bool
        Whether seeds change it; if so, it starts again with another one where it ends before the budget.
    """

    name: str
    title: str
    run: Callable[[Recorder, int], None]
    gradient: bool = False
    random: bool = True


OPTIMIZERS = {
    optimizer.name: optimizer
    for optimizer in (
        Optimizer("crs2", "nlopt CRS2-LM", crs2.run),
        Optimizer("isres", "nlopt ISRES", isres.run),
        Optimizer("esch", "nlopt ESCH", esch.run),
        Optimizer("mlsl-bobyqa", "nlopt MLSL-LDS + BOBYQA", mlsl.run_bobyqa),
        Optimizer("mlsl-lbfgs", "nlopt MLSL-LDS + L-BFGS", mlsl.run_lbfgs, gradient=True),
        Optimizer("stogo", "nlopt StoGO, randomised", stogo.run, gradient=True),
        Optimizer("ags", "nlopt AGS", ags.run, random=False),
        Optimizer("direct", "nlopt DIRECT-L", direct.run, random=False),
        Optimizer("dual-annealing", "scipy dual_annealing", annealing.run),
        Optimizer("evolution", "scipy differential_evolution", evolution.run),
        Optimizer("shgo", "scipy shgo", homology.run, gradient=True, random=False),
        Optimizer("least-squares", "scipy least_squares multi-start", multi_start.run, gradient=True),
        Optimizer("random", "random search", random_search.run),
    )
}
"""By name."""


def minimise(
    name: str | Optimizer,
    objective: Values,
    *,
    evaluations: int,
    seed: int = 0,
    target: float = -np.inf,
    seconds: float = np.inf,
) -> Trace:
    """Minimise an objective within its limits.

    Parameters
    ----------
    name : str or Optimizer
        One of OPTIMIZERS by its name, or one of your own.
    objective : Objective or Values
        Values where the optimizer uses no derivatives.
    evaluations : int
        Budget; a value with its gradient counts as two.
    seed : int
        0 or more. The same seed gives the same points (not the same times).
    target : float
        Stop at the first E at or below it.
    seconds : float
        Stop at the first evaluation after so much wall time; it makes runs differ from one another.

    Raises
    ------
    InputError
        Unknown name, a budget below 1, a negative seed, or an objective without the derivatives needed.
    """
    if isinstance(name, str) and name not in OPTIMIZERS:
        raise InputError(f"no optimizer is called {name!r}; there are {', '.join(OPTIMIZERS)}")
    optimizer = OPTIMIZERS[name] if isinstance(name, str) else name
    if evaluations < 1:
        raise InputError(f"evaluations is {evaluations}; give 1 or more")
    if seed < 0:
        raise InputError(f"seed is {seed}; give 0 or more")
    if optimizer.gradient and not hasattr(objective, "value_and_gradient"):
        raise InputError(f"optimizer {optimizer.name} uses derivatives, and this objective has none")
    recorder, attempt = Recorder(objective, evaluations, target, seconds), 0
    while not recorder.finished:
        before = recorder.spent
        state = np.random.SeedSequence([seed, attempt]).generate_state(1)[0]
        optimizer.run(recorder, int(state))
        attempt += 1
        if not optimizer.random or recorder.spent == before:
            break
    return recorder.trace(optimizer.name, seed)
