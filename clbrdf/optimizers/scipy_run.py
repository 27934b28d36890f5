"""What the adaptors of SciPy share: limits in its form, seeds under the name that its version takes."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from clbrdf.optimizers.trace import Recorder

if TYPE_CHECKING:
    from scipy.optimize import Bounds

FOREVER = 10_000_000
"""Iterations that no budget reaches: the recorder ends a run."""


def box(recorder: Recorder) -> Bounds:
    """Return the limits as SciPy takes them."""
    from scipy.optimize import Bounds

    return Bounds(recorder.lower, recorder.upper)


def random_numbers(solver: Callable[..., Any], seed: int) -> dict[str, Any]:
    """Return the argument that seeds a solver: `rng` since SciPy 1.15, `seed` before."""
    name = "rng" if "rng" in inspect.signature(solver).parameters else "seed"
    return {name: np.random.default_rng(seed)}
