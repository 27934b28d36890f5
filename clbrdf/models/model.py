"""What a reflectance model is to the rest of the package, whether one page, a sum of them, or part of one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.models.formula import Formula
from clbrdf.models.page import Example, Flags, Kind, Term
from clbrdf.models.parameter import Parameter
from clbrdf.models.structure import Structure

Array = npt.NDArray[np.float64]

Value = TypeVar("Value")

LOG2_OF_ZERO = -1.0e6
"""Stands for log2(0) in features: finite, so that no 0·∞ can arise, and far below any exponent."""


@dataclass(frozen=True, eq=False)
class Model:
    """A BRDF model: f(parameters, directions) in 1/sr, without the cosine of the view zenith.

    Attributes
    ----------
    name : str
        As it is asked for: "ggx", "ggx+minnaert", "wang2013-fresnel".
    origin : str
        The same with the path of a page that is a file of one's own.
    title, source : str
        What it is and where it is published.
    parameters : tuple of Parameter
        The table, in the order of every parameter axis.
    feature_names : tuple of str
        Names of the geometry features, in the order in which the kernel takes them.
    incident_features : int
        How many of them, the first ones, follow from the incident direction alone.
    features : callable
        Directions (N), type -> (N, F): everything the kernel needs of the geometry, finite, computed in fp64
        (the default) or fp32.
    brdf : callable
        (..., 1, P), (N, F) -> (..., N), 1/sr: the reference in fp64.
    jacobian : callable
        (..., 1, P), (N, F) -> (..., N, P): derivatives of `brdf` by the parameters, fp64.
    reference : callable
        (P,), θi, φi, θr, φr in degrees -> mpmath number in the working precision, slow.
    kernel : callable
        () -> text of its OpenCL functions (see kernels/models).
    formula : Formula
        The value as it is recorded from the page, whatever is tuned by hand.
    kind, flags, terms, examples
        As of the page; those of a sum follow from its parts, whose names are terms of it.
    derived : callable or None
        (..., P) -> (..., P), fp64: the parameters as the careful kernel takes them; None where the kernel has
        no careful form, and single precision is kept by computing in double.
    structure : Structure or None
        What a fit can solve without searching beyond the linear parameters.
    grazing : tuple of str
        Linear parameters without which (at 0) the integral over the hemisphere is finite.
    homogeneous : bool
        Whether f = Σ p ∂f/∂p over the linear parameters: nothing is left when they are 0.
    equal_parts : tuple of tuples of tuples of int
        Parts of a sum that are the same model: for each such set, the places of the parameters of each part.
    """

    name: str
    origin: str
    title: str
    source: str
    parameters: tuple[Parameter, ...]
    feature_names: tuple[str, ...]
    incident_features: int
    features: Callable[..., Array]
    brdf: Callable[[Array, Array], Array]
    jacobian: Callable[[Array, Array], Array]
    reference: Callable[..., Any]
    kernel: Callable[[], str]
    formula: Formula
    kind: Kind = "whole"
    flags: Flags = Flags.NONE
    terms: tuple[Term, ...] = ()
    examples: tuple[Example, ...] = ()
    derived: Callable[[Array], Array] | None = None
    structure: Structure | None = None
    grazing: tuple[str, ...] = ()
    homogeneous: bool = False
    equal_parts: tuple[tuple[tuple[int, ...], ...], ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Parameter names in table order."""
        return tuple(p.name for p in self.parameters)

    @property
    def defaults(self) -> Array:
        """The table's defaults, (P,)."""
        return np.array([p.default for p in self.parameters])

    @property
    def linear(self) -> tuple[int, ...]:
        """Places of the linear parameters."""
        return tuple(j for j, p in enumerate(self.parameters) if p.linear)

    def __reduce__(self) -> tuple[Callable[[str], Model], tuple[str]]:
        # Models are found by name in another process too.
        from clbrdf.models import remade

        return remade, (self.origin,)

    def vector(self, parameters: Mapping[str, npt.ArrayLike]) -> Array:
        """Stack named values to (P,) or (W, P), with defaults where a name is missing.

        Raises
        ------
        InputError
            An unknown name, a value that is not finite or of the wrong sign, lengths that do not agree, or
            no value for a parameter that has no default.
        """
        parameters = self.by_full_name(parameters)
        for p in self.parameters:
            if p.given and p.name not in parameters:
                raise InputError(f"model {self.name} needs {p.name} ({p.meaning}, {p.unit}); give its value")
        columns = [
            numbers_of(f"parameter {p.name}", parameters.get(p.name, p.default)) for p in self.parameters
        ]
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
        places = [self.names.index(name) for name in self.grazing if name in self.names]
        return bool((parameters[..., places] > 0.0).any())

    def parameter(self, name: str) -> Parameter:
        """Return the row of the table with a name."""
        return next(p for p in self.parameters if p.name == name)

    def places(self, names: tuple[str, ...]) -> list[int]:
        """Return the rows of the table with some names."""
        return [self.names.index(name) for name in names]

    def full_name(self, name: str) -> str:
        """Return the name in the table: of a sum, "alpha" stands for "ggx.alpha" where no other part has one.

        Raises
        ------
        InputError
            No parameter has this name, or several parts have one.
        """
        if name in self.names:
            return name
        meant = [full for full in self.names if full.split(".")[-1] == name]
        if len(meant) > 1:
            raise InputError(f"model {self.name}: {name!r} may be {' or '.join(meant)}; give the whole name")
        if not meant:
            raise InputError(f"model {self.name} has no parameter {name!r}; it has {', '.join(self.names)}")
        return meant[0]

    def by_full_name(self, mapping: Mapping[str, Value]) -> dict[str, Value]:
        """Return a mapping with the names of the table as its keys.

        Raises
        ------
        InputError
            As `full_name`, a parameter that is named twice, or no mapping.
        """
        if not isinstance(mapping, Mapping):
            raise InputError(
                f"parameters are given as {type(mapping).__name__}; give a mapping of their names, as in"
                f" {{{self.names[0]!r}: ...}}"
            )
        out: dict[str, Value] = {}
        for name, value in mapping.items():
            full = self.full_name(name)
            if full in out:
                raise InputError(f"parameter {full} is given twice; give each parameter once")
            out[full] = value
        return out

    def check_names(self, mapping: Mapping[str, object]) -> None:
        """Raise InputError where a mapping names a parameter that the model does not have."""
        self.by_full_name(mapping)

    def bounds(self, overrides: Mapping[str, tuple[float, float]] | None = None) -> Array:
        """Limits of a fit, (P, 2), with those given replacing the table's.

        Raises
        ------
        InputError
            Unknown name, a pair that is not increasing, or on a log scale a sign change.
        """
        chosen = self.by_full_name(overrides or {})
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
        """Limits of the coordinates q, (..., P, 2), increasing, for limits of the values (..., P, 2)."""
        pairs = [p.to_coordinate(bounds[..., j, :]) for j, p in enumerate(self.parameters)]
        return np.sort(np.stack(pairs, axis=-2), axis=-1)

    def value_bounds(self, lower: Array, upper: Array) -> Array:
        """Limits of the values, (..., P, 2), increasing, for limits of the coordinates, each (..., P)."""
        ends = [self.from_coordinates(lower), self.from_coordinates(upper)]
        return np.sort(np.stack(ends, axis=-1), axis=-1)

    def to_coordinates(self, parameters: Array) -> Array:
        """Parameters (..., P) to coordinates q (..., P)."""
        columns = [p.to_coordinate(parameters[..., j]) for j, p in enumerate(self.parameters)]
        return np.stack(columns, axis=-1)

    def from_coordinates(self, coordinates: Array) -> Array:
        """Coordinates q (..., P) to parameters (..., P)."""
        columns = [p.from_coordinate(coordinates[..., j]) for j, p in enumerate(self.parameters)]
        return np.stack(columns, axis=-1)


def numbers_of(name: str, value: npt.ArrayLike) -> Array:
    """Return a value as float64; raise InputError, which begins with its name, where it is no number."""
    try:
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{name} is {value!r}; give a number, or one a wavelength") from None
