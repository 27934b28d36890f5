"""Differential evolution, a whole population a call (SciPy).

Source: Storn and Price, J. Glob. Optim. 11 (1997) 341.
"""

from __future__ import annotations

import warnings
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from clbrdf.optimizers.scipy_run import FOREVER, box, random_numbers
from clbrdf.optimizers.trace import Finished, Recorder

Array = npt.NDArray[np.float64]

SAME = 1e-10
"""Relative spread of E at which a population counts as one point; below the smallest gap asked for, 1e-8."""


def run(recorder: Recorder, seed: int, same: float = SAME) -> None:
    """Run differential evolution until the recorder has finished or the population is one point to `same`."""
    from scipy.optimize import differential_evolution

    def values(q: Array) -> Array:  # the stubs do not know whole populations
        return recorder.values(q.T)

    try:
        with warnings.catch_warnings():
            # Values of HUGE make its measure of convergence overflow.
            warnings.simplefilter("ignore", RuntimeWarning)
            differential_evolution(
                cast(Any, values),
                box(recorder),
                maxiter=FOREVER,
                tol=same,
                polish=False,
                updating="deferred",
                vectorized=True,
                **random_numbers(differential_evolution, seed),
            )
    except Finished:
        return
