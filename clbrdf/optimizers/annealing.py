"""Generalised simulated annealing with local searches (SciPy's dual_annealing, its default settings).

Source: Xiang, Sun, Fan and Gong, Phys. Lett. A 233 (1997) 216.
"""

from __future__ import annotations

from clbrdf.optimizers.scipy_run import FOREVER, box, random_numbers
from clbrdf.optimizers.trace import Finished, Recorder


def run(recorder: Recorder, seed: int) -> None:
    """Run dual annealing until the recorder has finished."""
    from scipy.optimize import dual_annealing

    try:
        dual_annealing(
            recorder.value,
            box(recorder),
            maxiter=FOREVER,
            maxfun=FOREVER,
            **random_numbers(dual_annealing, seed),
        )
    except Finished:
        return
