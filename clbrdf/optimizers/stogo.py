"""Branch and bound with gradients, randomised (nlopt).

Source: Madsen, Zertchaninov and Zilinskas, "Global Optimization using Branch-and-Bound" (1998).
"""

from __future__ import annotations

from clbrdf.optimizers.nlopt_run import run_nlopt
from clbrdf.optimizers.trace import Recorder


def run(recorder: Recorder, seed: int) -> None:
    """Run StoGO until the recorder has finished."""
    run_nlopt(recorder, "GD_STOGO_RAND", seed)
