"""Evolutionary algorithm of da Silva Santos (nlopt)."""

from __future__ import annotations

from clbrdf.optimizers.nlopt_run import run_nlopt
from clbrdf.optimizers.trace import Recorder


def run(recorder: Recorder, seed: int) -> None:
    """Run ESCH until the recorder has finished."""
    run_nlopt(recorder, "GN_ESCH", seed)
