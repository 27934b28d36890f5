"""Bounded least squares with the analytic Jacobian from random starts, again and again (SciPy).

Source: Branch, Coleman and Li, SIAM J. Sci. Comput. 21 (1999) 1 (the trust region).
"""

from __future__ import annotations

import numpy as np

from clbrdf.optimizers.objective import HUGE
from clbrdf.optimizers.trace import Finished, Recorder

MOST_EVALUATIONS = 200
"""Of residuals, from one start."""

TOLERANCE = 1e-10
"""Below the smallest gap that benchmarks ask for, 1e-8."""


def run(recorder: Recorder, seed: int) -> None:
    """Run least squares from uniformly random starts until the recorder has finished."""
    from scipy.optimize import least_squares

    rng = np.random.default_rng(seed)
    try:
        while True:
            start = rng.uniform(recorder.lower, recorder.upper)
            if not recorder.value(start) < HUGE:
                continue
            with np.errstate(all="ignore"):
                try:
                    least_squares(
                        recorder.residuals,
                        start,
                        jac=recorder.residual_jacobian,
                        bounds=(recorder.lower, recorder.upper),
                        x_scale="jac",
                        max_nfev=MOST_EVALUATIONS,
                        ftol=TOLERANCE,
                        xtol=TOLERANCE,
                        gtol=TOLERANCE,
                    )
                except (ValueError, np.linalg.LinAlgError):  # residuals or derivatives beyond fp64
                    continue
    except Finished:
        return
