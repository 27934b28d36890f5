"""A model's formula, recorded once: the value of a page is called with these and leaves its expression.

    tape = Tape()
    x, k = tape.leaf("x"), tape.leaf("k")
    f = k * exp(-x * x)

An expression is a node of a tape: an operation on earlier nodes. Equal operations on equal nodes are one
node, and what follows from constants is computed at once. From the tape come values in NumPy and mpmath
(`clbrdf.models.numeric`), derivatives (`clbrdf.models.derivative`) and kernels (`clbrdf.models.kernel`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Node:
    """One operation: its name, the places of its operands on the tape, and the value or name of a leaf."""

    operation: str
    operands: tuple[int, ...] = ()
    value: float | str = 0.0


@dataclass
class Tape:
    """Nodes in the order in which they were recorded, each after its operands."""

    nodes: list[Node] = field(default_factory=list)
    names: dict[int, str] = field(default_factory=dict)
    """What some nodes are called, for readable kernels."""
    _places: dict[Node, int] = field(default_factory=dict)

    def constant(self, value: float) -> Expression:
        """Return a constant."""
        return self.put(Node("constant", (), float(value)))

    def leaf(self, name: str) -> Expression:
        """Return the quantity of a name, whose value is given later."""
        return named(name, self.put(Node("leaf", (), name)))

    @property
    def pi(self) -> Expression:
        """π, exact to the digits of whatever arithmetic follows."""
        return self.put(Node("pi"))

    def put(self, node: Node) -> Expression:
        """Return the expression of a node, recorded if it is new."""
        place = self._places.get(node)
        if place is None:
            place = len(self.nodes)
            self.nodes.append(node)
            self._places[node] = place
        return Expression(self, place)


@dataclass(frozen=True, eq=False)
class Expression:
    """A node of a tape; arithmetic on it records further nodes."""

    tape: Tape
    place: int

    @property
    def node(self) -> Node:
        """The operation."""
        return self.tape.nodes[self.place]

    @property
    def constant(self) -> float | None:
        """The value of a constant, None for what is not constant."""
        return float(self.node.value) if self.node.operation == "constant" else None

    def __neg__(self) -> Expression:
        if self.constant is not None:
            return self.tape.constant(-self.constant)
        if self.node.operation == "negative":
            return Expression(self.tape, self.node.operands[0])
        return self._record("negative")

    def __add__(self, other: Expression | float) -> Expression:
        b = self._other(other)
        if self.constant is not None and b.constant is not None:
            return self.tape.constant(self.constant + b.constant)
        if self.constant == 0.0:
            return b
        if b.constant == 0.0:
            return self
        if b.node.operation == "negative":
            return self - Expression(self.tape, b.node.operands[0])
        return self._record("add", b)

    def __radd__(self, other: float) -> Expression:
        return self._other(other) + self

    def __sub__(self, other: Expression | float) -> Expression:
        b = self._other(other)
        if self.constant is not None and b.constant is not None:
            return self.tape.constant(self.constant - b.constant)
        if self.constant == 0.0:
            return -b
        if b.constant == 0.0:
            return self
        if b.place == self.place:
            return self.tape.constant(0.0)
        if b.node.operation == "negative":
            return self + Expression(self.tape, b.node.operands[0])
        return self._record("subtract", b)

    def __rsub__(self, other: float) -> Expression:
        return self._other(other) - self

    def __mul__(self, other: Expression | float) -> Expression:
        b = self._other(other)
        if self.constant is not None and b.constant is not None:
            return self.tape.constant(self.constant * b.constant)
        for one, two in ((self, b), (b, self)):
            if one.constant == 0.0:
                return one
            if one.constant == 1.0:
                return two
            if one.constant == -1.0:
                return -two
            if one.node.operation == "negative":
                return -(Expression(self.tape, one.node.operands[0]) * two)
        return self._record("multiply", b)

    def __rmul__(self, other: float) -> Expression:
        return self._other(other) * self

    def __truediv__(self, other: Expression | float) -> Expression:
        b = self._other(other)
        if b.constant == 0.0:
            raise ZeroDivisionError("a model divides by zero")
        if self.constant is not None and b.constant is not None:
            return self.tape.constant(self.constant / b.constant)
        if self.constant == 0.0:
            return self
        if b.constant == 1.0:
            return self
        if b.constant == -1.0:
            return -self
        if self.node.operation == "negative":
            return -(Expression(self.tape, self.node.operands[0]) / b)
        return self._record("divide", b)

    def __rtruediv__(self, other: float) -> Expression:
        return self._other(other) / self

    def __pow__(self, exponent: int) -> Expression:
        if not isinstance(exponent, int) or exponent < 1:
            raise TypeError("a model takes whole powers from 1; write sqrt, or exp(g * log(x)), for others")
        half = self ** (exponent // 2) if exponent > 1 else None
        if half is None:
            return self
        return half * half * self if exponent % 2 else half * half

    def __lt__(self, other: Expression | float) -> Condition:
        return Condition(self, self._other(other))

    def __gt__(self, other: Expression | float) -> Condition:
        return Condition(self._other(other), self)

    def __bool__(self) -> bool:
        raise TypeError("a model cannot branch on a value with 'if'; write where(a < b, x, y)")

    def _other(self, value: Expression | float) -> Expression:
        return value if isinstance(value, Expression) else self.tape.constant(value)

    def _record(self, operation: str, *others: Expression) -> Expression:
        return self.tape.put(Node(operation, (self.place, *(o.place for o in others))))


@dataclass(frozen=True)
class Condition:
    """Whether one expression is less than another."""

    less: Expression
    than: Expression


def where(condition: Condition, chosen: Expression | float, other: Expression | float) -> Expression:
    """Return one expression where a condition holds, and another elsewhere. Both are computed."""
    a, b = condition.less, condition.than
    x, y = a._other(chosen), a._other(other)
    if x.place == y.place:
        return x
    if a.constant is not None and b.constant is not None:
        return x if a.constant < b.constant else y
    return a.tape.put(Node("choose", (a.place, b.place, x.place, y.place)))


def named(name: str, a: Expression) -> Expression:
    """Give an expression a name, which kernels show; return it."""
    a.tape.names.setdefault(a.place, name)
    return a


def least(a: Expression, b: Expression | float) -> Expression:
    """Return the smaller of two."""
    return where(a < b, a, b)


def greatest(a: Expression, b: Expression | float) -> Expression:
    """Return the larger of two."""
    return where(a > b, a, b)


def magnitude(a: Expression) -> Expression:
    """Return |a|."""
    return where(a < 0.0, -a, a)


def sqrt(a: Expression) -> Expression:
    """Square root."""
    return _function("sqrt", a, math.sqrt)


def exp(a: Expression) -> Expression:
    """Exponential."""
    return _function("exp", a, math.exp)


def log(a: Expression) -> Expression:
    """Natural logarithm of what is positive; of 0 it is about −7e5, whose exponential is 0, not −∞."""
    return _function("log", a, lambda x: math.log(x) if x > 0.0 else LOG_OF_ZERO)


def log1p(a: Expression) -> Expression:
    """log(1 + a), also for small a."""
    return _function("log1p", a, math.log1p)


def erfcx(a: Expression) -> Expression:
    """Scaled complementary error function exp(a²) erfc(a), for a ≥ 0."""
    if a.constant is not None:
        from scipy.special import erfcx as of_scipy

        return a.tape.constant(float(of_scipy(a.constant)))
    return a._record("erfcx")


def sin(a: Expression) -> Expression:
    """Sine of radians."""
    return _function("sin", a, math.sin)


def cos(a: Expression) -> Expression:
    """Cosine of radians."""
    return _function("cos", a, math.cos)


def tan(a: Expression) -> Expression:
    """Tangent of radians."""
    return _function("tan", a, math.tan)


def atan2(a: Expression, b: Expression) -> Expression:
    """Angle of the point (b, a), radians."""
    return a._record("atan2", b)


def power(a: Expression, exponent: Expression | float) -> Expression:
    """Return a to any power, for a ≥ 0, as exp(exponent · log a)."""
    return exp(exponent * log(a)) if isinstance(exponent, Expression) else exp(log(a) * exponent)


LOG_OF_ZERO = -1.0e6 * math.log(2.0)
"""Stands for log(0): finite, so that no 0·∞ can arise, and far below any exponent."""


def _function(name: str, a: Expression, of_constant: object) -> Expression:
    if a.constant is not None:
        return a.tape.constant(of_constant(a.constant))  # type: ignore[operator]
    return a._record(name)
