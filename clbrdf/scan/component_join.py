"""Components of several scans as those of the scan that they make together.

Components of the same name and forms are one source: "reference panel" in two scans is the same panel, and
its error is the same in both. Where a scan lacks a component, it does not act. Groups and matrices of
different scans have nothing in common.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from clbrdf.scan.component import Component
from clbrdf.scan.correlation import Correlation

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]


def joined_components(
    parts: Sequence[Sequence[Component]], values: Places, rows: Places, columns: Places, sizes: Sequence[int]
) -> tuple[Component, ...]:
    """Return the components of a joined scan.

    Parameters
    ----------
    parts : sequence of sequence of Component
        Of each scan.
    values : (N, W) int
        Where each value comes from, counted through all values of all scans; −1 where there is none.
    rows, columns : (N, 2), (W, 2) int
        Scan and place in it that each direction and each wavelength comes from first.
    sizes : sequence of int
        Values of each scan.
    """
    sources: dict[tuple[object, ...], list[Component | None]] = {}
    for k, components in enumerate(parts):
        for one in components:
            sources.setdefault(_key(one), [None] * len(parts))[k] = one
    out: list[Component] = []
    for found in sources.values():
        first = next(one for one in found if one is not None)
        flat = np.concatenate(
            [
                np.zeros(size) if one is None else np.ravel(one.values)
                for one, size in zip(found, sizes, strict=True)
            ]
        )
        out.append(
            Component(
                _unique(first.name, [other.name for other in out]),
                np.where(values < 0, 0.0, flat[values]),
                first.relative,
                _joined([None if one is None else one.direction for one in found], rows),
                first.incident_angle,
                _joined([None if one is None else one.wavelength for one in found], columns),
            )
        )
    return tuple(out)


def _key(one: Component) -> tuple[object, ...]:
    forms = (one.direction, one.incident_angle, one.wavelength)
    return (one.name, one.relative, *((c.form, None if np.isnan(c.width) else c.width) for c in forms))


def _joined(found: Sequence[Correlation | None], places: Places) -> Correlation:
    """Return the correlation of places (n, 2), each a scan and the place in it."""
    first = next(one for one in found if one is not None)
    n = len(places)
    if first.form == "groups":
        numbers, offset = np.full(n, -1, dtype=np.int64), 0
        for k, one in enumerate(found):
            here = places[:, 0] == k
            if one is not None and one.groups is not None:
                _, own = np.unique(one.groups, return_inverse=True)
                numbers[here] = offset + own.ravel()[places[here, 1]]
                offset += int(own.max()) + 1
        return Correlation("groups", groups=numbers)
    if first.form == "matrix":
        matrix = np.eye(n)
        for k, one in enumerate(found):
            here = np.flatnonzero(places[:, 0] == k)
            if one is not None and one.matrix is not None:
                own = places[here, 1]
                matrix[np.ix_(here, here)] = one.matrix[np.ix_(own, own)]
        return Correlation("matrix", matrix=matrix)
    return first


def _unique(name: str, taken: Sequence[str]) -> str:
    if name not in taken:
        return name
    return next(other for k in range(2, len(taken) + 3) if (other := f"{name} ({k})") not in taken)
