"""Derivatives of a recorded formula, recorded on the same tape.

Reverse accumulation: one pass from the value back to the leaves gives the derivatives by all of them.
Source: Griewank and Walther, Evaluating Derivatives (2nd ed., 2008), chapter 3.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from clbrdf.models.expression import Condition, Expression, cos, sin, where

TWO_OVER_ROOT_PI = 2.0 / math.sqrt(math.pi)


def gradient(value: Expression, leaves: Sequence[Expression]) -> list[Expression]:
    """Return ∂value/∂leaf for each of some leaves."""
    tape = value.tape
    wanted = {leaf.place for leaf in leaves}
    depends = [False] * (value.place + 1)
    for place in range(value.place + 1):
        operands = tape.nodes[place].operands
        depends[place] = place in wanted or any(depends[k] for k in operands)
    adjoint: dict[int, Expression] = {value.place: tape.constant(1.0)}
    for place in range(value.place, -1, -1):
        if place not in adjoint or not depends[place] or place in wanted:
            continue
        node = Expression(tape, place)
        for operand, part in _parts(node, adjoint[place], depends):
            adjoint[operand] = adjoint[operand] + part if operand in adjoint else part
    zero = tape.constant(0.0)
    return [adjoint.get(leaf.place, zero) for leaf in leaves]


def _parts(f: Expression, s: Expression, depends: list[bool]) -> list[tuple[int, Expression]]:
    """Return for each operand that matters the share s · ∂f/∂operand."""
    operands = [Expression(f.tape, k) for k in f.node.operands]
    rule = RULES[f.node.operation]
    return [
        (operand.place, rule(k, s, f, operands))
        for k, operand in enumerate(operands)
        if depends[operand.place] and not (f.node.operation == "choose" and k < 2)
    ]


Rule = Callable[[int, Expression, Expression, list[Expression]], Expression]


def _choose(k: int, s: Expression, f: Expression, x: list[Expression]) -> Expression:
    zero = f.tape.constant(0.0)
    condition = Condition(x[0], x[1])
    return where(condition, s, zero) if k == 2 else where(condition, zero, s)


RULES: dict[str, Rule] = {
    "negative": lambda _k, s, _f, _x: -s,
    "add": lambda _k, s, _f, _x: s,
    "subtract": lambda k, s, _f, _x: s if k == 0 else -s,
    "multiply": lambda k, s, _f, x: s * x[1 - k],
    "divide": lambda k, s, f, x: s / x[1] if k == 0 else -(s / x[1] * f),
    "sqrt": lambda _k, s, f, _x: s * 0.5 / f,
    "exp": lambda _k, s, f, _x: s * f,
    "log": lambda _k, s, _f, x: s / x[0],
    "log1p": lambda _k, s, _f, x: s / (1.0 + x[0]),
    "erfcx": lambda _k, s, f, x: s * (2.0 * x[0] * f - TWO_OVER_ROOT_PI),
    "sin": lambda _k, s, _f, x: s * cos(x[0]),
    "cos": lambda _k, s, _f, x: -(s * sin(x[0])),
    "tan": lambda _k, s, f, _x: s * (1.0 + f * f),
    "choose": _choose,
}
"""For each operation: place of the operand, share s, the node, its operands -> s · ∂f/∂operand."""
