"""Controlled random search with local mutation (nlopt).

Source: Kaelo and Ali, J. Optim. Theory Appl. 130 (2006) 253.
"""

from __future__ import annotations

from clbrdf.optimizers.nlopt_run import run_nlopt
from clbrdf.optimizers.trace import Recorder


def run(recorder: Recorder, seed: int) -> None:
    """Run CRS2-LM until the recorder has finished."""
    run_nlopt(recorder, "GN_CRS2_LM", seed)
