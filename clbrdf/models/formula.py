"""A recorded value taken apart: what the host forms of the geometry, and what is left for the kernels.

Whatever depends on the geometry alone becomes a feature, as large a part of the expression as possible,
formed once a direction in fp64. What is left is an expression of features and parameters, and so are its
derivatives.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.geometry import Directions, check_reflection
from clbrdf.models.angles import ANGLES, INCIDENT, Geometry
from clbrdf.models.derivative import gradient
from clbrdf.models.expression import Expression, Tape
from clbrdf.models.numeric import (
    NUMPY,
    angles_in_mpmath,
    angles_in_numpy,
    expression_values,
    mpmath_operations,
    needed,
)

Array = npt.NDArray[np.float64]

Record = Callable[[Geometry, Sequence[Expression]], Expression]
"""Geometry and parameters -> value."""


@dataclass(frozen=True, eq=False)
class Formula:
    """The value of a model with P parameters, in two forms.

    Attributes
    ----------
    whole : Expression
        Of angles and parameters.
    parameters_of_whole : tuple of Expression
    features : tuple of Expression
        Of angles alone, on the tape of `whole`; those of the incident direction first.
    incident_features : int
    value : Expression
        Of features and parameters, on a tape of its own.
    gradient : tuple of Expression
        ∂value/∂parameter.
    parameters, feature_leaves : tuple of Expression
        Leaves of `value`.
    """

    whole: Expression
    parameters_of_whole: tuple[Expression, ...]
    features: tuple[Expression, ...]
    incident_features: int
    value: Expression
    gradient: tuple[Expression, ...]
    parameters: tuple[Expression, ...]
    feature_leaves: tuple[Expression, ...]

    @property
    def feature_names(self) -> tuple[str, ...]:
        """What kernels call the features."""
        return tuple(str(leaf.node.value) for leaf in self.feature_leaves)

    def features_at(self, directions: Directions) -> Array:
        """Features (N, F) of N directions."""
        check_reflection(directions)
        if not self.features:
            return np.empty((len(directions), 0))
        values = expression_values(self.features, self._angles(directions), NUMPY)
        return np.stack([np.broadcast_to(v, len(directions)) for v in values], axis=-1)

    def values(self, parameters: Array, x: Array) -> Array:
        """f (..., N) of parameters (..., 1, P) and features (N, F)."""
        return self._broadcast([self.value], parameters, x)[0]

    def jacobian(self, parameters: Array, x: Array) -> Array:
        """∂f/∂p (..., N, P) of parameters (..., 1, P) and features (N, F)."""
        return np.stack(self._broadcast(list(self.gradient), parameters, x), axis=-1)

    def reference(self, parameters: Array, theta_i: float, phi_i: float, theta_r: float, phi_r: float) -> Any:
        """Value in the working precision of mpmath."""
        import mpmath

        angles = angles_in_mpmath(theta_i, phi_i, theta_r, phi_r)
        tape = self.whole.tape
        given = {tape.leaf(name).place: angles[name] for name in ANGLES}
        for leaf, value in zip(self.parameters_of_whole, parameters, strict=True):
            given[leaf.place] = mpmath.mpf(float(value))
        return expression_values([self.whole], given, mpmath_operations())[0]

    def _angles(self, directions: Directions) -> Mapping[int, Any]:
        tape = self.whole.tape
        leaves = {
            k: str(tape.nodes[k].value) for k in needed(self.features, {}) if not tape.nodes[k].operands
        }
        names = {place: name for place, name in leaves.items() if name in ANGLES}
        values = angles_in_numpy(directions, names.values())
        return {place: values[name] for place, name in names.items()}

    def _broadcast(self, wanted: list[Expression], parameters: Array, x: Array) -> list[Array]:
        given = {leaf.place: parameters[..., j] for j, leaf in enumerate(self.parameters)}
        given |= {leaf.place: x[:, k] for k, leaf in enumerate(self.feature_leaves)}
        shape = np.broadcast_shapes(parameters.shape[:-1], (len(x),))
        return [np.array(np.broadcast_to(v, shape)) for v in expression_values(wanted, given, NUMPY)]


def take_apart(record: Record, symbols: Sequence[str]) -> Formula:
    """Record a value of parameters with some symbols, and take it apart."""
    tape = Tape()
    leaves = tuple(tape.leaf(f"p {symbol}") for symbol in symbols)
    whole = record(Geometry(tape), leaves)
    of_parameters, of_geometry, of_view = _dependence(whole, leaves)

    inner, moved, found = Tape(), dict[int, Expression](), dict[int, str]()
    taken: set[str] = {"p", "m", "x", *symbols}

    def move(place: int) -> Expression:
        if place in moved:
            return moved[place]
        node = tape.nodes[place]
        if of_geometry[place] and not of_parameters[place]:
            found[place] = _name(tape, place, taken)
            moved[place] = inner.leaf(found[place])
        elif node.operation == "leaf":
            moved[place] = inner.leaf(str(node.value)[2:])
        else:
            operands = tuple(move(k).place for k in node.operands)
            moved[place] = inner.put(type(node)(node.operation, operands, node.value))
            if place in tape.names:
                inner.names.setdefault(moved[place].place, tape.names[place])
        return moved[place]

    value = move(whole.place)
    order = sorted(found, key=lambda place: (of_view[place], place))
    parameters = tuple(inner.leaf(symbol) for symbol in symbols)
    return Formula(
        whole=whole,
        parameters_of_whole=leaves,
        features=tuple(Expression(tape, place) for place in order),
        incident_features=sum(not of_view[place] for place in order),
        value=value,
        gradient=tuple(gradient(value, parameters)),
        parameters=parameters,
        feature_leaves=tuple(inner.leaf(found[place]) for place in order),
    )


def depends_on(value: Expression, leaf: Expression) -> bool:
    """Whether a value depends on a leaf."""
    stack, seen = [value.place], set[int]()
    while stack:
        place = stack.pop()
        if place == leaf.place:
            return True
        if place not in seen:
            seen.add(place)
            stack.extend(value.tape.nodes[place].operands)
    return False


def _dependence(whole: Expression, leaves: Sequence[Expression]) -> tuple[list[bool], list[bool], list[bool]]:
    """Tell for each node up to the whole whether parameters, angles, and angles of the view enter it."""
    parameters = {leaf.place for leaf in leaves}
    of_parameters, of_geometry, of_view = list[bool](), list[bool](), list[bool]()
    for place, node in enumerate(whole.tape.nodes[: whole.place + 1]):
        angle = node.operation == "leaf" and place not in parameters
        of_parameters.append(place in parameters or any(of_parameters[k] for k in node.operands))
        of_geometry.append(angle or any(of_geometry[k] for k in node.operands))
        seen = angle and node.value not in INCIDENT
        of_view.append(seen or any(of_view[k] for k in node.operands))
    return of_parameters, of_geometry, of_view


def _name(tape: Tape, place: int, taken: set[str]) -> str:
    """Return a name for a feature: its own, that of a function of a named one, or a number."""
    name, node = tape.names.get(place), tape.nodes[place]
    if name is None and len(node.operands) == 1 and node.operands[0] in tape.names:
        name = f"{node.operation}_{tape.names[node.operands[0]]}"
    if name is None or name in taken:
        name = next(f"x{k}" for k in range(1, 1000) if f"x{k}" not in taken)
    taken.add(name)
    return name
