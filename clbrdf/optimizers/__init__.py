"""Global optimizers of others behind one protocol: the same objective, limits, budget, seeds and record.

    trace = minimise("mlsl-lbfgs", objective, evaluations=4000, seed=0)

`objective` is E of (13) at one wavelength, in NumPy or on the device.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from clbrdf.errors import InputError
from clbrdf.optimizers import annealing, evolution, homology, multi_start, random_search
from clbrdf.optimizers.nlopt_run import run_nlopt
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


def _nlopt(
    name: str,
    title: str,
    algorithm: str,
    local: str | None = None,
    *,
    gradient: bool = False,
    random: bool = True,
) -> Optimizer:
    run = partial(run_nlopt, algorithm=algorithm, local=local)
    return Optimizer(name, f"nlopt {title}", run, gradient, random)


OPTIMIZERS = {
    optimizer.name: optimizer
    for optimizer in (
        # Controlled random search with local mutation: Kaelo and Ali, J. Optim. Theory Appl. 130 (2006) 253.
        _nlopt("crs2", "CRS2-LM", "GN_CRS2_LM"),
        # Stochastic ranking evolution strategy: Runarsson and Yao, IEEE Trans. Syst. Man Cybern. C 35 (2005)
        # 233.
        _nlopt("isres", "ISRES", "GN_ISRES"),
        # Evolutionary algorithm of da Silva Santos.
        _nlopt("esch", "ESCH", "GN_ESCH"),
        # Local searches from a low-discrepancy sequence, one a cluster: Kucherenko and Sytsko, Comput. Optim.
        # Appl. 30 (2005) 297. BOBYQA needs no gradient, L-BFGS takes ours.
        _nlopt("mlsl-bobyqa", "MLSL-LDS + BOBYQA", "G_MLSL_LDS", "LN_BOBYQA"),
        _nlopt("mlsl-lbfgs", "MLSL-LDS + L-BFGS", "G_MLSL_LDS", "LD_LBFGS", gradient=True),
        # Branch and bound with gradients: Madsen, Zertchaninov and Zilinskas, "Global Optimization using
        # Branch-and-Bound" (1998).
        _nlopt("stogo", "StoGO, randomised", "GD_STOGO_RAND", gradient=True),
        # A Hilbert curve with estimated Lipschitz constants; it may stop by itself: Strongin and Sergeyev,
        # Global Optimization with Non-Convex Constraints (2000).
        _nlopt("ags", "AGS", "GN_AGS", random=False),
        # Dividing rectangles, locally biased: Gablonsky and Kelley, J. Glob. Optim. 21 (2001) 27.
        _nlopt("direct", "DIRECT-L", "GN_DIRECT_L", random=False),
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
