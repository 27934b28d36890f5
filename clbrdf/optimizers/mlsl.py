"""Multi-level single linkage: local searches from a low-discrepancy sequence, one a cluster (nlopt).

Source: Kucherenko and Sytsko, Comput. Optim. Appl. 30 (2005) 297.
"""

from __future__ import annotations

from clbrdf.optimizers.nlopt_run import run_nlopt
from clbrdf.optimizers.trace import Recorder


def run_bobyqa(recorder: Recorder, seed: int) -> None:
    """Run MLSL with BOBYQA, which needs no gradient, until the recorder has finished."""
    run_nlopt(recorder, "G_MLSL_LDS", seed, local="LN_BOBYQA")


def run_lbfgs(recorder: Recorder, seed: int) -> None:
    """Run MLSL with L-BFGS and the analytic gradient until the recorder has finished."""
    run_nlopt(recorder, "G_MLSL_LDS", seed, local="LD_LBFGS")
