"""Improved stochastic ranking evolution strategy (nlopt).

Source: Runarsson and Yao, IEEE Trans. Syst. Man Cybern. C 35 (2005) 233.
"""

from __future__ import annotations

from clbrdf.optimizers.nlopt_run import run_nlopt
from clbrdf.optimizers.trace import Recorder


def run(recorder: Recorder, seed: int) -> None:
    """Run ISRES until the recorder has finished."""
    run_nlopt(recorder, "GN_ISRES", seed)
