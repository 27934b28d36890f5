"""Precision as a named choice: what arithmetic, how exact, in one record."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clbrdf.errors import InputError


@dataclass(frozen=True)
class Precision:
    """Arithmetic of a kernel.

    Attributes
    ----------
    name : str
        "fast:3" to "fast:6", "single" or "double"; "fast" alone is "fast:4".
    dtype : type
        float32 or float64.
    degree : int
        Of the polynomial in exp2, in double precision of that for its root (kernels/lib/exp2.cl).
    careful : bool
        Whether more than fp32 is carried where a model needs it: the exponent as an unevaluated sum of two
        numbers where the model has such a form, everything in fp64 where it has none.
    bound : float
        Relative error of model values within the default bounds of the parameters, wherever f > 1e-30;
        measured on the hard cases and on random points of the domain by tests/test_precision.py.
    """

    name: str
    dtype: type[np.floating]
    degree: int
    careful: bool
    bound: float


PRECISIONS = {
    p.name: p
    for p in (
        Precision("fast:3", np.float32, 3, False, 3e-2),
        Precision("fast:4", np.float32, 4, False, 1e-3),
        Precision("fast:5", np.float32, 5, False, 3e-4),
        Precision("fast:6", np.float32, 6, False, 2e-4),
        Precision("single", np.float32, 6, True, 1e-5),
        Precision("double", np.float64, 8, False, 5e-13),
    )
}
"""By name, from the least to the most exact. Outside the default bounds errors grow with the exponents."""


def get_precision(name: str) -> Precision:
    """Return a precision by its name.

    Raises
    ------
    InputError
        No precision has this name.
    """
    known = PRECISIONS.get("fast:4" if name == "fast" else name)
    if known is None:
        names = ", ".join(("fast", *PRECISIONS))
        raise InputError(f"no precision is called {name!r}; there are {names}; evaluate has reference, too")
    return known
