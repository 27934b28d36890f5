"""Dividing rectangles, locally biased (nlopt).

Source: Gablonsky and Kelley, J. Glob. Optim. 21 (2001) 27.
"""

from __future__ import annotations

from clbrdf.optimizers.nlopt_run import run_nlopt
from clbrdf.optimizers.trace import Recorder


def run(recorder: Recorder, seed: int) -> None:
    """Run DIRECT-L until the recorder has finished."""
    run_nlopt(recorder, "GN_DIRECT_L", seed)
