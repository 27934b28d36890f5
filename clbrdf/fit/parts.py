"""Equal parts of a sum, such as two lobes of one model: a swap changes nothing, so one order counts."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clbrdf.models import Model

Array = npt.NDArray[np.float64]


def in_order(
    model: Model,
    values: Array,
    bounds: Array,
    known: npt.NDArray[np.bool_],
    shared: npt.NDArray[np.bool_] | None = None,
) -> Array:
    """Return parameters or coordinates (K, P), equal parts in rising order of their first nonlinear one.

    Parts with limits of their own, (P, 2), or given parameters, (P,), stay where they are; so do those of
    which one shares with all wavelengths, (P,), what the other does not.
    """
    out = values.copy()
    for parts in model.equal_parts:
        places = np.array(parts)
        searched = [k for k, j in enumerate(places[0]) if not model.parameters[j].linear]
        if known[places].any() or not (bounds[places] == bounds[places[0]]).all():
            continue
        if shared is not None and shared[places].any():
            alike = (shared[places] == shared[places[0]]).all()
            if not (alike and shared[places[0]][searched[0] if searched else 0]):
                continue
        key = out[:, places[:, searched[0] if searched else 0]]
        order = np.argsort(key, axis=1, kind="stable")
        out[:, places] = np.take_along_axis(out[:, places], order[..., None], axis=1)
    return out
