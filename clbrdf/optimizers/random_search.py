"""Uniformly random points: the floor that every optimizer has to be above."""

from __future__ import annotations

import numpy as np

from clbrdf.optimizers.trace import Finished, Recorder

BATCH = 64


def run(recorder: Recorder, seed: int) -> None:
    """Draw points until the recorder has finished."""
    rng = np.random.default_rng(seed)
    try:
        while True:
            recorder.values(rng.uniform(recorder.lower, recorder.upper, (BATCH, len(recorder.lower))))
    except Finished:
        return
