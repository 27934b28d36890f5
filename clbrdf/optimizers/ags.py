"""Reduction to one dimension along a Hilbert curve, with estimated Lipschitz constants (nlopt).

Source: Strongin and Sergeyev, Global Optimization with Non-Convex Constraints (2000).
"""

from __future__ import annotations

from clbrdf.optimizers.nlopt_run import run_nlopt
from clbrdf.optimizers.trace import Recorder


def run(recorder: Recorder, seed: int) -> None:
    """Run AGS until the recorder has finished, or until it stops by itself, which it may."""
    run_nlopt(recorder, "GN_AGS", seed)
