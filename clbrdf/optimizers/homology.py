"""Simplicial homology: local searches from the minimisers of a sampled complex (SciPy's shgo).

Source: Endres, Sandrock and Focke, J. Glob. Optim. 72 (2018) 181.
"""

from __future__ import annotations

import warnings

import numpy as np
import numpy.typing as npt

from clbrdf.optimizers.scipy_run import FOREVER, box
from clbrdf.optimizers.trace import Finished, Recorder

Array = npt.NDArray[np.float64]


def run(recorder: Recorder, seed: int) -> None:
    """Run SHGO until the recorder has finished or it stops by itself; it draws no random numbers."""
    from scipy.optimize import shgo

    del seed
    last: dict[bytes, Array] = {}

    def value(q: Array) -> float:
        return recorder.value(q)

    def gradient(q: Array) -> Array:
        key = np.asarray(q).tobytes()
        if key not in last:
            last.clear()
            last[key] = recorder.value_and_gradient(np.asarray(q))[1]
        return last[key]

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            shgo(
                value,
                box(recorder),
                iters=FOREVER,
                sampling_method="simplicial",
                minimizer_kwargs={"method": "L-BFGS-B", "jac": gradient},
                options={"jac": gradient},
            )
    except Finished:
        return
