"""Places of directions and columns of a scan by what they are: angles, wavelengths, bands."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]

SAME_ANGLE = 1e-6
"""Degrees."""


def places_of(name: str, values: Array, wanted: float | slice | Iterable[float], nearest: bool) -> Places:
    """Return the places of values that are asked for, in the order of the values.

    Parameters
    ----------
    name : str
        For the message.
    values : (N,) float64
    wanted : float, slice or sequence of float
        A slice takes from start to stop, both included.
    nearest : bool
        Whether a number stands for the nearest value, or for the same to SAME_ANGLE.

    Raises
    ------
    InputError
        Nothing is left.
    """
    if isinstance(wanted, slice):
        if wanted.step is not None:
            raise InputError(f"{name}: a slice takes from start to stop, and has no step here")
        low = -np.inf if wanted.start is None else float(wanted.start)
        high = np.inf if wanted.stop is None else float(wanted.stop)
        found = np.flatnonzero((values >= low) & (values <= high))
        said = f"from {low:g} to {high:g}"
    else:
        numbers = np.atleast_1d(np.asarray(wanted, dtype=np.float64))
        apart = np.abs(values[None, :] - numbers[:, None])
        if nearest:
            found = np.unique(apart.argmin(axis=1))
        else:
            found = np.flatnonzero((apart <= SAME_ANGLE).any(axis=0))
        said = ", ".join(f"{number:g}" for number in numbers)
    if not len(found):
        raise InputError(f"the scan has no {name} {said}; it has {values.min():g} to {values.max():g}")
    return found
