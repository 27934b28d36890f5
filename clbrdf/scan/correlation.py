"""How the errors of one component belong together along one dimension of a scan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError

Array = npt.NDArray[np.float64]
Places = Sequence[int] | slice | npt.NDArray[np.bool_] | npt.NDArray[np.intp]

FORMS = ("random", "systematic", "bell", "groups", "matrix")
"""What a correlation may be:

random
    errors at different places have nothing to do with each other
systematic
    one error for all places
bell
    exp(−d² / (2 w²)) for places d apart, w the width
groups
    one error for all places of a group, such as the rows that share a dark spectrum; none across groups
matrix
    correlation coefficients, given one by one
"""

ROUNDING = 1e-9
"""By which coefficients may be off, and eigenvalues below 0, for each place."""

NEGLIGIBLE = 1e-10
"""Share of the largest eigenvalue of a correlation below which a mode says nothing."""


@dataclass(frozen=True, eq=False)
class Correlation:
    """Correlation of a component's errors along one dimension of n places; immutable.

    Attributes
    ----------
    form : str
        One of FORMS.
    width : float
        Of a bell, in the unit of the dimension: degrees for directions and incident zeniths, nm for
        wavelengths; else NaN.
    groups : (n,) int64 or None
        Number of each place's group.
    matrix : (n, n) float64 or None
        Coefficients: symmetric, 1 on the diagonal, positive semidefinite.

    Raises
    ------
    InputError
        An unknown form, a bell without a positive width, coefficients that are no correlation matrix.
    """

    form: str = "random"
    width: float = float("nan")
    groups: npt.NDArray[np.int64] | None = None
    matrix: Array | None = None

    def __post_init__(self) -> None:
        if self.form not in FORMS:
            raise InputError(f"the form {self.form!r} is unknown; give one of {', '.join(FORMS)}")
        if self.form == "bell" and not (np.isfinite(self.width) and self.width > 0.0):
            raise InputError(f"the width of the bell is {self.width:g}; give a positive one")
        for name, given, kind in (("groups", self.groups, np.int64), ("matrix", self.matrix, np.float64)):
            if (self.form == name) != (given is not None):
                raise InputError(f"the form {self.form!r} {'needs' if given is None else 'takes no'} {name}")
            if given is not None:
                values = np.array(given, dtype=kind)
                values.flags.writeable = False
                object.__setattr__(self, name, values)
        if self.groups is not None and self.groups.ndim != 1:
            raise InputError(f"groups have {self.groups.ndim} dimensions; give one number for each place")
        if self.matrix is not None:
            check_matrix(self.matrix)

    @property
    def length(self) -> int | None:
        """Number of places that the correlation is for; None where it fits any."""
        own = self.groups if self.groups is not None else self.matrix
        return None if own is None else len(own)

    def take(self, places: Places) -> Correlation:
        """Return the correlation among some of the places."""
        if self.groups is not None:
            return Correlation(self.form, groups=self.groups[places])
        if self.matrix is not None:
            return Correlation(self.form, matrix=self.matrix[places][:, places])
        return self

    def same(self, other: Correlation) -> bool:
        """Whether two correlations say the same of the same places."""
        return (
            self.form == other.form
            and np.array_equal(self.width, other.width, equal_nan=True)
            and _equal(self.groups, other.groups)
            and _equal(self.matrix, other.matrix)
        )

    def coefficients(self, coordinates: Array) -> Array:
        """Return the correlation coefficients (n, n) of places at coordinates (n,) or (n, 3)."""
        n = len(coordinates)
        if self.form == "random":
            return np.eye(n)
        if self.form == "systematic":
            return np.ones((n, n))
        if self.groups is not None:
            return np.asarray(self.groups[:, None] == self.groups[None, :], dtype=np.float64)
        if self.matrix is not None:
            return self.matrix
        return bell(coordinates, self.width)

    def modes(self, coordinates: Array) -> Array:
        """Return a factor F (n, m) with F Fᵀ the coefficients, m as small as they allow.

        Not for the form "random", whose n modes are the places themselves.
        """
        if self.form == "systematic":
            return np.ones((len(coordinates), 1))
        if self.groups is not None:
            _, numbers = np.unique(self.groups, return_inverse=True)
            return np.eye(int(numbers.max()) + 1)[numbers.ravel()]
        return covariance_factor(self.coefficients(coordinates))


def bell(coordinates: Array, width: float) -> Array:
    """Return exp(−d² / (2 w²)) for the distances d between coordinates (n,) or (n, 3)."""
    points = coordinates.reshape(len(coordinates), -1)
    square = ((points[:, None, :] - points[None, :, :]) ** 2).sum(axis=2)
    return np.asarray(np.exp(-square / (2.0 * width**2)))


def covariance_factor(matrix: Array) -> Array:
    """Return F (n, m) with F Fᵀ a positive semidefinite matrix, without modes that rounding hides."""
    values, vectors = np.linalg.eigh(matrix)
    kept = values > NEGLIGIBLE * max(float(values[-1]), 0.0)
    return np.asarray(vectors[:, kept] * np.sqrt(values[kept]))


def check_matrix(matrix: Array) -> None:
    """Raise InputError, saying where, if coefficients (n, n) are no correlation matrix."""
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1]:
        raise InputError(f"the correlation matrix has shape {matrix.shape}; it has to be square")
    if not np.isfinite(matrix).all():
        place = _place(~np.isfinite(matrix))
        raise InputError(f"the correlation matrix is {matrix[place]:g} at {list(place)}; give a number")
    if (np.abs(matrix) > 1.0 + ROUNDING).any():
        place = _place(np.abs(matrix) > 1.0 + ROUNDING)
        raise InputError(
            f"the correlation matrix is {matrix[place]:g} at {list(place)}; coefficients lie in −1 to 1"
            " (a covariance matrix has to be divided by the uncertainties first)"
        )
    lopsided = np.abs(matrix - matrix.T) > ROUNDING
    if lopsided.any():
        i, j = _place(lopsided)
        raise InputError(
            f"the correlation matrix is not symmetric: {matrix[i, j]:g} at [{i}, {j}] and"
            f" {matrix[j, i]:g} at [{j}, {i}]; give both the same"
        )
    if (np.abs(np.diagonal(matrix) - 1.0) > ROUNDING).any():
        k = int(np.argmax(np.abs(np.diagonal(matrix) - 1.0) > ROUNDING))
        raise InputError(
            f"the correlation matrix is {matrix[k, k]:g} at [{k}, {k}]; every place"
            " correlates with itself by 1"
        )
    try:
        np.linalg.cholesky(matrix + ROUNDING * len(matrix) * np.eye(len(matrix)))
    except np.linalg.LinAlgError:
        least = np.linalg.eigvalsh(matrix)[0]
        raise InputError(
            f"the correlation matrix is indefinite (its smallest eigenvalue is {least:.3g}): no errors can"
            " correlate like this; lower its coefficients, or estimate all of them from the same readings"
        ) from None


def _place(where: npt.NDArray[np.bool_]) -> tuple[int, ...]:
    return tuple(int(k[0]) for k in np.nonzero(where))


def _equal(one: npt.NDArray[np.generic] | None, other: npt.NDArray[np.generic] | None) -> bool:
    return one is other or (one is not None and other is not None and np.array_equal(one, other))
