"""What a reflectance model is to the rest of the package: one table, one page of physics.

A model is a file pair. `clbrdf/models/<name>.py` defines ``MODEL``: the parameter table, the geometry
features in fp64, and the reference evaluation in NumPy. `kernels/models/<name>.cl` holds the same
function for OpenCL. Everything else is written against :class:`Model` and finds the pair by its name.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.models.structure import Structure

Array = npt.NDArray[np.float64]

LOG2_OF_ZERO = -1.0e6
"""Stands for log2(0) in features: finite, so that no 0·∞ can arise, and far below any exponent."""


@dataclass(frozen=True)
class Parameter:
    """One row of a model's parameter table.

    Attributes
    ----------
    name, unit, meaning : str
        As in the paper; the unit is "1" for a pure number.
    default : float
        Used where the user gives none.
    bounds : (float, float)
        Default limits of a fit.
    scale : "linear" or "log"
        The coordinate q in which a fit moves: the value p itself, or log2 |p| for parameters that span
        decades.
    log_floor : float
        For scale "log": the smallest |p| a fit looks at when a bound is 0, in the parameter's unit.
    """

    name: str
    unit: str
    default: float
    bounds: tuple[float, float]
    meaning: str
    scale: Literal["linear", "log"] = "linear"
    log_floor: float = 0.0

    @property
    def sign(self) -> float:
        """Sign of all values within the default bounds: −1 or +1."""
        return -1.0 if self.bounds[1] <= 0.0 else 1.0

    def to_coordinate(self, value: npt.ArrayLike) -> Array:
        """Coordinate q of a value; on a log scale values nearer to 0 than `log_floor` map to the floor."""
        values = np.asarray(value, dtype=np.float64)
        if self.scale == "linear":
            return values
        return np.log2(np.maximum(self.sign * values, self.log_floor))

    def from_coordinate(self, coordinate: npt.ArrayLike) -> Array:
        """Value of a coordinate q."""
        coordinates = np.asarray(coordinate, dtype=np.float64)
        return coordinates if self.scale == "linear" else self.sign * np.exp2(coordinates)

    def slope(self, value: npt.ArrayLike) -> Array:
        """dp/dq at a value p."""
        values = np.asarray(value, dtype=np.float64)
        return np.ones_like(values) if self.scale == "linear" else values * np.log(2.0)


@dataclass(frozen=True)
class Term:
    """A part of a model that can be left out: a summand becomes 0, a factor becomes 1.

    Attributes
    ----------
    name, meaning : str
    neutral : tuple of (str, float)
        Parameters that only this term takes, and values that stand for them when it is left out.
    features : tuple of str
        Geometry features that only this term takes.
    factor_of : str
        The summand it is a factor of, "" for a summand.
    """

    name: str
    meaning: str
    neutral: tuple[tuple[str, float], ...]
    features: tuple[str, ...] = ()
    factor_of: str = ""


@dataclass(frozen=True)
class Model:
    """A BRDF model: f(parameters, directions) in 1/sr, without the cosine of the view zenith.

    Attributes
    ----------
    name : str
        The stem of both files of the pair.
    title, source : str
        What it is and where it is published.
    parameters : tuple of Parameter
        The table, in the order of every parameter axis.
    feature_names : tuple of str
        Names of the geometry features, in the order in which the kernel takes them.
    incident_features : int
        How many of them, the first ones, follow from the incident direction alone.
    features : callable
        Directions (N), type, terms left out -> (N, F): everything the kernel needs of the geometry, finite,
        computed in fp64 (the default) or fp32.
    brdf : callable
        (..., 1, P), (N, F) -> (..., N), 1/sr: the reference in fp64.
    derived : callable
        (..., P) -> (..., P): the parameters as the careful kernel takes them, fp64.
    reference : callable
        (P,), θi, θr, φ in degrees -> mpmath number: the equations as published, slow.
    jacobian : callable
        (..., 1, P), (N, F) -> (..., N, P): derivatives of `brdf` by the parameters, fp64.
    structure : Structure or None
        What a fit can solve without searching; None for a model that has no such parts.
    grazing : str
        Name of the parameter without which (at 0) the integral over the hemisphere is finite; "" where it
        always is.
    terms : tuple of Term
        What can be left out, by :func:`clbrdf.models.terms.restrict`.
    left_out : frozenset of str
        What has been left out; empty for the model as published.
    """

    name: str
    title: str
    source: str
    parameters: tuple[Parameter, ...]
    feature_names: tuple[str, ...]
    incident_features: int
    features: Callable[..., Array]
    brdf: Callable[[Array, Array], Array]
    jacobian: Callable[[Array, Array], Array]
    derived: Callable[[Array], Array]
    reference: Callable[..., Any]
    structure: Structure | None = None
    grazing: str = ""
    terms: tuple[Term, ...] = ()
    left_out: frozenset[str] = frozenset()

    @property
    def names(self) -> tuple[str, ...]:
        """Parameter names in table order."""
        return tuple(p.name for p in self.parameters)

    def __reduce__(self) -> tuple[Callable[[str, frozenset[str]], Model], tuple[str, frozenset[str]]]:
        # Models are found by name in another process too.
        from clbrdf.models.terms import get_restricted

        return get_restricted, (self.name, self.left_out)

    def vector(self, parameters: Mapping[str, npt.ArrayLike]) -> Array:
        """Stack named values to (P,) or (W, P), with defaults where a name is missing.

        Raises
        ------
        InputError
            An unknown name, a value that is not finite or of the wrong sign, or lengths that do not agree.
        """
        self.check_names(parameters)
        columns = [np.asarray(parameters.get(p.name, p.default), dtype=np.float64) for p in self.parameters]
        for name, column in zip(self.names, columns, strict=True):
            if not np.isfinite(column).all():
                raise InputError(f"parameter {name} is not finite")
            if self.parameter(name).scale == "log" and (self.parameter(name).sign * column < 0.0).any():
                side = "at most" if self.parameter(name).sign < 0 else "at least"
                raise InputError(f"parameter {name} is {column.flat[0]:g}; it has to be {side} 0")
            if column.ndim > 1:
                raise InputError(
                    f"parameter {name} has {column.ndim} dimensions; give a number or a (W,) array"
                )
        try:
            return np.stack(np.broadcast_arrays(*columns), axis=-1)
        except ValueError as error:
            sizes = ", ".join(f"{n}: {c.size}" for n, c in zip(self.names, columns, strict=True) if c.ndim)
            raise InputError(f"parameters have different lengths ({sizes})") from error

    def diverges(self, parameters: Array) -> bool:
        """Whether the integral over the hemisphere has no bound for some of the parameters (..., P)."""
        if self.grazing not in self.names:
            return False
        return bool((parameters[..., self.names.index(self.grazing)] > 0.0).any())

    def parameter(self, name: str) -> Parameter:
        """Return the row of the table with a name."""
        return next(p for p in self.parameters if p.name == name)

    def places(self, names: tuple[str, ...]) -> list[int]:
        """Return the rows of the table with some names."""
        return [self.names.index(name) for name in names]

    def check_names(self, mapping: Mapping[str, object]) -> None:
        """Raise InputError where a mapping names a parameter that the model does not have."""
        unknown = [name for name in mapping if name not in self.names]
        if unknown:
            raise InputError(
                f"model {self.name} has no parameter {unknown[0]!r}; it has {', '.join(self.names)}"
            )

    def bounds(self, overrides: Mapping[str, tuple[float, float]] | None = None) -> Array:
        """Limits of a fit, (P, 2), with those given replacing the table's.

        Raises
        ------
        InputError
            Unknown name, a pair that is not increasing, or on a log scale a sign change.
        """
        chosen = dict(overrides or {})
        self.check_names(chosen)
        rows = []
        for p in self.parameters:
            pair = np.asarray(chosen.get(p.name, p.bounds), dtype=np.float64)
            if pair.shape != (2,) or not np.isfinite(pair).all() or not pair[0] < pair[1]:
                raise InputError(
                    f"bounds of {p.name} are {chosen[p.name]}; give a lower and a larger upper limit"
                )
            if p.scale == "log" and (p.sign * pair < 0.0).any():
                side = "at most" if p.sign < 0 else "at least"
                raise InputError(
                    f"bounds of {p.name} are [{pair[0]:g}, {pair[1]:g}]; both have to be {side} 0"
                )
            rows.append(pair)
        return np.array(rows)

    def coordinate_bounds(self, bounds: Array) -> Array:
        """Limits of the coordinates q, (P, 2), increasing, for limits of the values."""
        pairs = [p.to_coordinate(row) for p, row in zip(self.parameters, bounds, strict=True)]
        return np.sort(np.array(pairs), axis=1)

    def value_bounds(self, lower: Array, upper: Array) -> Array:
        """Limits of the values, (P, 2), increasing, for limits of the coordinates, each (P,)."""
        return np.sort(np.stack([self.from_coordinates(lower), self.from_coordinates(upper)], axis=1), axis=1)

    def to_coordinates(self, parameters: Array) -> Array:
        """Parameters (..., P) to coordinates q (..., P)."""
        columns = [p.to_coordinate(parameters[..., j]) for j, p in enumerate(self.parameters)]
        return np.stack(columns, axis=-1)

    def from_coordinates(self, coordinates: Array) -> Array:
        """Coordinates q (..., P) to parameters (..., P)."""
        columns = [p.from_coordinate(coordinates[..., j]) for j, p in enumerate(self.parameters)]
        return np.stack(columns, axis=-1)
