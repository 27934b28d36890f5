"""What is known of the sign of a recorded quantity: an exponential that stays below 1 is cheaper to form."""

from __future__ import annotations

from collections.abc import Collection

from clbrdf.models.expression import Tape

POSITIVE_ANGLES = ("sin_i", "cos_i", "sin_r", "cos_r", "cos_h", "sin_m", "cos_m", "cos_p", "psi")
"""Angles of reflection (`clbrdf.models.angles`) that are never below 0."""

NEVER_NEGATIVE = ("pi", "sqrt", "exp", "exp2", "erfcx", "erfcx_raised")


def sign(tape: Tape, place: int, not_negative: Collection[int]) -> int:
    """Return 1 for what is never below 0, −1 for what is never above, 0 for what may be both.

    `not_negative` holds the leaves that are never below 0.
    """
    known: dict[int, int] = {}

    def of(k: int) -> int:
        if k not in known:
            known[k] = _sign(k)
        return known[k]

    def _sign(k: int) -> int:
        node = tape.nodes[k]
        if node.operation == "constant":
            return 1 if float(node.value) >= 0.0 else -1
        if node.operation == "leaf":
            return int(k in not_negative)
        if node.operation in NEVER_NEGATIVE:
            return 1
        signs = [of(operand) for operand in node.operands]
        match node.operation:
            case "negative":
                return -signs[0]
            case "log1p":
                return max(signs[0], 0)
            case "multiply" if node.operands[0] == node.operands[1]:
                return 1
            case "multiply" | "divide":
                return signs[0] * signs[1]
            case "add":
                return signs[0] if signs[0] == signs[1] else 0
            case "subtract":
                return signs[0] if signs[0] == -signs[1] else 0
            case "choose":
                less, than, chosen, other = node.operands
                if (chosen, other) == (than, less) and 1 in signs[2:]:
                    return 1  # the larger of two
                return signs[2] if signs[2] == signs[3] else 0
            case _:
                return 0

    return of(place)
