"""From single values in any order to the rectangle of a scan: directions × columns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]

MOST_EMPTY = 100
"""A rectangle may be so many times larger than what fills it, where it is large."""

LARGE = 10_000_000
"""Values."""


@dataclass(frozen=True, eq=False)
class Rectangle:
    """Where M values go in N rows × W columns.

    Attributes
    ----------
    row, column : (M,) intp
        Place of each value.
    first : (N,) intp
        The first value of each row.
    shape : (int, int)
        (N, W).
    """

    row: Places
    column: Places
    first: Places
    shape: tuple[int, int]

    def filled(self, values: npt.NDArray[np.generic], empty: float | int) -> npt.NDArray[np.generic]:
        """Return values (M,) in their places (N, W), `empty` where there is none."""
        out = np.full(self.shape, empty, dtype=values.dtype)
        out[self.row, self.column] = values
        return out


def arrange(keys: Array, column: Places, columns: int) -> Rectangle:
    """Arrange M values in a rectangle.

    Rows keep the order of their first value. The k-th value of a direction in a column belongs to the k-th
    repeat of that direction, a row of its own.

    Parameters
    ----------
    keys : (M, K) float64
        What makes two directions the same: their angles, and whatever else sets them apart.
    column : (M,) intp
    columns : int
        W.

    Raises
    ------
    InputError
        A large rectangle that would stay nearly empty: almost every value has a wavelength of its own.
    """
    direction = group_numbers(keys)
    repeat = _occurrence(direction * columns + column)
    _, first, row = np.unique(
        direction * (int(repeat.max(initial=0)) + 1) + repeat, return_index=True, return_inverse=True
    )
    order = np.argsort(first, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    shape = (len(first), columns)
    if shape[0] * shape[1] > max(LARGE, MOST_EMPTY * len(keys)):
        raise InputError(
            f"{len(keys)} values lie in {shape[0]} directions at {shape[1]} wavelengths, and hardly"
            " any direction has more than one; round the wavelengths, or import them a part at a time"
        )
    return Rectangle(rank[row.reshape(-1)], column, first[order], shape)


def group_numbers(keys: Array) -> Places:
    """Return a number for each row of keys (M, K), the same for equal rows, (M,)."""
    order = np.lexsort(keys.T[::-1])
    ordered = keys[order]
    with np.errstate(invalid="ignore"):
        same = (ordered[1:] == ordered[:-1]) | (np.isnan(ordered[1:]) & np.isnan(ordered[:-1]))
    new = np.append(0, np.cumsum(~same.all(axis=1)))[: len(keys)]
    out = np.empty(len(keys), dtype=np.intp)
    out[order] = new
    return out


def _occurrence(key: Places) -> Places:
    """Return how many equal keys stand before each key, (M,)."""
    order = np.argsort(key, kind="stable")
    ordered = key[order]
    begins = np.flatnonzero(np.append(True, ordered[1:] != ordered[:-1]))[: len(key)]
    lengths = np.diff(np.append(begins, len(key)))
    out = np.empty(len(key), dtype=np.intp)
    out[order] = np.arange(len(key)) - np.repeat(begins, lengths)
    return out
