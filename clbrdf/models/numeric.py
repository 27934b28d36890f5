"""A recorded formula in numbers: NumPy arrays, or mpmath for as many digits as one likes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from clbrdf.geometry import Directions, cos_deg, sin_deg
from clbrdf.models.expression import LOG_OF_ZERO, Expression

Operations = Mapping[str, Callable[..., Any]]


def needed(values: Sequence[Expression], given: Mapping[int, Any]) -> list[int]:
    """Return the places on the tape that some values need, in order, without what is given."""
    tape, wanted, stack = values[0].tape, set(), [v.place for v in values]
    while stack:
        place = stack.pop()
        if place not in wanted and place not in given:
            wanted.add(place)
            stack.extend(tape.nodes[place].operands)
    return sorted(wanted)


def expression_values(
    values: Sequence[Expression], given: Mapping[int, Any], operations: Operations
) -> list[Any]:
    """Return values for given quantities, by their places on the tape.

    What is not needed any more is let go, so that only a few arrays are alive at a time.
    """
    nodes, plan = values[0].tape.nodes, needed(values, given)
    last = {k: place for place in plan for k in nodes[place].operands}
    kept, known = {v.place for v in values}, dict(given)
    for place in plan:
        node = nodes[place]
        if node.operation == "leaf":
            raise KeyError(f"no value is given for {node.value!r}")
        if node.operation == "constant":
            known[place] = operations["constant"](node.value)
        else:
            known[place] = operations[node.operation](*(known[k] for k in node.operands))
        for k in set(node.operands):
            if last[k] == place and k not in kept and k not in given:
                del known[k]
    return [known[v.place] for v in values]


def _log(x: Any) -> Any:
    positive = x > 0.0
    return np.where(positive, np.log(np.where(positive, x, 1.0)), LOG_OF_ZERO)


def _erfcx(x: Any) -> Any:
    from scipy.special import erfcx

    return erfcx(x)


NUMPY: Operations = {
    "constant": float,
    "pi": lambda: float(np.pi),
    "negative": np.negative,
    "add": np.add,
    "subtract": np.subtract,
    "multiply": np.multiply,
    "divide": np.divide,
    "sqrt": np.sqrt,
    "exp": np.exp,
    "log": _log,
    "log1p": np.log1p,
    "erfcx": _erfcx,
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "atan2": np.arctan2,
    "choose": lambda a, b, x, y: np.where(a < b, x, y),
}


def mpmath_operations() -> Operations:
    """Return the operations in the working precision of mpmath."""
    import mpmath as mp

    def scaled_erfc(x: Any) -> Any:
        return mp.exp(x * x) * mp.erfc(x)

    return {
        "constant": mp.mpf,
        "pi": lambda: +mp.pi,
        "negative": lambda a: -a,
        "add": lambda a, b: a + b,
        "subtract": lambda a, b: a - b,
        "multiply": lambda a, b: a * b,
        "divide": lambda a, b: a / b,
        "sqrt": mp.sqrt,
        "exp": mp.exp,
        "log": lambda a: mp.log(a) if a > 0 else mp.mpf(LOG_OF_ZERO),
        "log1p": lambda a: mp.log(1 + a),
        "erfcx": scaled_erfc,
        "sin": mp.sin,
        "cos": mp.cos,
        "tan": mp.tan,
        "atan2": mp.atan2,
        "choose": lambda a, b, x, y: x if a < b else y,
    }


def angles_in_numpy(directions: Directions, names: Iterable[str]) -> dict[str, Any]:
    """Return some of the angles of `clbrdf.models.angles`, by name, each (N,), good to 2 ulp.

    Each is the sine of an angle that is exact before it is rounded to radians.
    """
    half = directions.turn / 2.0
    degrees = {
        "i": directions.theta_i,
        "r": directions.theta_r,
        "h": (directions.theta_i - directions.theta_r) / 2.0,
        "m": (directions.theta_i + directions.theta_r) / 2.0,
        "p": half,
        "phi_i": directions.phi_i,
    }
    out = {}
    for name in names:
        function, _, angle = name.partition("_")
        if name == "psi":
            out[name] = np.deg2rad(2.0 * np.abs(half))
        elif angle == "phi_i":
            turned = np.where(degrees[angle] > 180.0, degrees[angle] - 360.0, degrees[angle])
            out[name] = sin_deg(turned) if function == "sin" else cos_deg(turned)
        elif function == "sin":
            out[name] = np.sin(np.deg2rad(degrees[angle]))
        else:
            out[name] = np.sin(np.deg2rad(90.0 - np.abs(degrees[angle])))
    return out


def angles_in_mpmath(theta_i: float, phi_i: float, theta_r: float, phi_r: float) -> dict[str, Any]:
    """Return the angles of `clbrdf.models.angles`, by name, of degrees."""
    import mpmath as mp

    i, r, turn = mp.mpf(theta_i), mp.mpf(theta_r), mp.mpf(phi_r) - mp.mpf(phi_i)
    turn = turn - 360 * mp.floor(turn / 360)
    folded = turn - 360 if turn > 180 else turn
    out: dict[str, Any] = {"psi": mp.radians(abs(folded))}
    for name, degrees in (
        *(("i", i), ("r", r), ("h", (i - r) / 2), ("m", (i + r) / 2), ("p", folded / 2)),
        ("phi_i", mp.mpf(phi_i)),
    ):
        out[f"sin_{name}"], out[f"cos_{name}"] = mp.sin(mp.radians(degrees)), mp.cos(mp.radians(degrees))
    return out
