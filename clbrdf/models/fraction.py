"""A formula rewritten for the inner loop: as few divisions as possible, and all that can be formed early.

A division takes a processor as long as some ten multiplications, and those of neighbouring directions queue
for one unit. So each quantity is carried as

    early · Π above / Π below

where `early` is known before the view direction is, and sums are brought to a common denominator. Nothing is
divided before a root, an exponential or a condition asks for a number. No difference is formed that the page
does not form, so that what it keeps free of cancellation stays so; each further product costs half a unit in
the last place.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from clbrdf.models.expression import Expression, Node, Tape
from clbrdf.models.numeric import needed

LOG2_E = 1.0 / math.log(2.0)

COSTS = {
    "divide": 10.0,
    "sqrt": 15.0,
    "exp": 16.0,
    "exp2": 15.0,
    "log": 30.0,
    "log1p": 35.0,
    "erfcx": 70.0,
    "erfcx_raised": 60.0,
}
"""Of operations in a direction, in multiplications; what is not named costs 1."""

Early = Callable[[int], bool]
"""Whether the node of a place is formed before the view direction is known."""


@dataclass(frozen=True)
class Fraction:
    """One quantity: a factor that is formed early, and places on the tape with their powers."""

    early: Expression
    above: Counter[int] = field(default_factory=Counter)
    below: Counter[int] = field(default_factory=Counter)

    def over(self) -> Expression:
        """Return the numerator."""
        product = _product(self.early.tape, self.above)
        if self.early.node.operation == "negative" and self.above:
            # Left to itself the sign would be taken out of the product, and not be formed early.
            return product.tape.put(Node("multiply", (self.early.place, product.place)))
        return self.early * product

    def under(self) -> Expression | None:
        """Return the denominator, None where it is 1."""
        return _product(self.early.tape, self.below) if self.below else None

    def value(self) -> Expression:
        """Return the quantity, divided."""
        under = self.under()
        return self.over() if under is None else self.over() / under


def fractions(outputs: Sequence[Expression], early: Early) -> list[Fraction]:
    """Return the cheapest form of some quantities."""
    forms = [rewritten(outputs, early, at_once) for at_once in (False, True)]
    return min(forms, key=lambda form: cost([f.value() for f in form], early))


def spread(f: Fraction, early: Early) -> Fraction:
    """Return e (a x + b y) z as ((e a) x + (e b) y) z, where e, a and b are formed early."""
    for place, count in f.above.items():
        inside = _times(f.early, Expression(f.early.tape, place), early) if count == 1 else None
        if inside is not None and f.early.constant is None:
            above = f.above - Counter({place: 1}) + Counter({inside.place: 1})
            return Fraction(f.early.tape.constant(1.0), above, f.below)
    return f


def _times(factor: Expression, total: Expression, early: Early) -> Expression | None:
    """Return factor · total without a multiplication in a direction; None where there is no such form."""
    tape, node = total.tape, total.node
    if early(total.place):
        return factor * total
    terms = [Expression(tape, k) for k in node.operands]
    if node.operation in ("add", "subtract"):
        a, b = (_times(factor, term, early) for term in terms)
        if a is None or b is None:
            return None
        return a - b if node.operation == "subtract" else a + b
    if node.operation == "multiply" and any(early(k) for k in node.operands):
        first, other = sorted(terms, key=lambda e: not early(e.place))
        return factor * first * other
    return None


def cost(outputs: Sequence[Expression], early: Early) -> float:
    """Return what the operations of a direction cost, in multiplications."""
    if not outputs:
        return 0.0
    nodes = outputs[0].tape.nodes
    late = (nodes[k] for k in needed(outputs, {}) if not early(k))
    return sum(COSTS.get(node.operation, 1.0) for node in late if node.operands)


def rewritten(outputs: Sequence[Expression], early: Early, at_once: bool) -> list[Fraction]:
    """Return quantities as fractions; `at_once` divides what several others need as soon as it is formed."""
    return _Rewriter(outputs, early, at_once).outputs()


def _product(tape: Tape, factors: Counter[int]) -> Expression:
    out = tape.constant(1.0)
    for place in sorted(factors):
        out = out * Expression(tape, place) ** factors[place]
    return out


class _Rewriter:
    """Forms one fraction for each node, from those of its operands."""

    def __init__(self, outputs: Sequence[Expression], early: Early, at_once: bool) -> None:
        self._outputs, self._early, self._at_once = outputs, early, at_once
        self._tape = outputs[0].tape
        self._one = self._tape.constant(1.0)
        self._done: dict[int, Fraction] = {}

    def outputs(self) -> list[Fraction]:
        plan = needed(self._outputs, {})
        uses = Counter(k for place in plan for k in self._tape.nodes[place].operands)
        for place in plan:
            form = self._form(place, self._tape.nodes[place])
            if self._at_once and form.below and uses[place] > 1:
                divided = Fraction(self._one, form.above, form.below).value()
                form = self._atom(divided, form.early)
            self._done[place] = form
        return [spread(self._done[output.place], self._early) for output in self._outputs]

    def _atom(
        self, quantity: Expression, early: Expression | None = None, below: Counter[int] | None = None
    ) -> Fraction:
        factor = self._one if early is None else early
        return Fraction(factor, Counter({quantity.place: 1}), below or Counter())

    def _form(self, place: int, node: Node) -> Fraction:
        quantity = Expression(self._tape, place)
        if self._early(place):
            return Fraction(quantity)
        operands = [self._done[k] for k in node.operands]
        match node.operation:
            case "multiply":
                return self._quotient(operands, [])
            case "divide":
                return self._quotient(operands[:1], operands[1:])
            case "negative":
                (a,) = operands
                return Fraction(-a.early, a.above, a.below)
            case "add" | "subtract":
                a, b = operands
                return self._sum(a, b, subtract=node.operation == "subtract")
            case "exp":
                (a,) = operands
                power = Fraction(a.early * LOG2_E, a.above, a.below).value()
                return self._atom(self._tape.put(Node("exp2", (power.place,))))
            case "erfcx":
                # The kernels have it as a polynomial over 1 + 2x.
                x = operands[0].value()
                raised = self._tape.put(Node("erfcx_raised", (x.place,)))
                return self._atom(raised, None, Counter({(1.0 + (x + x)).place: 1}))
            case "choose":
                return self._choice(*operands)
            case _:
                values = tuple(a.value().place for a in operands)
                return self._atom(self._tape.put(Node(node.operation, values, node.value)))

    def _quotient(self, above: Sequence[Fraction], below: Sequence[Fraction]) -> Fraction:
        early, over, under = self._one, Counter[int](), Counter[int]()
        for a in above:
            early, over, under = early * a.early, over + a.above, under + a.below
        for b in below:
            same = early.place == b.early.place
            early = self._one if same else early / b.early
            over, under = over + b.below, under + b.above
        common = over & under
        return Fraction(early, over - common, under - common)

    def _sum(self, a: Fraction, b: Fraction, subtract: bool) -> Fraction:
        below = a.below | b.below
        same = a.early.place == b.early.place
        x, y = (
            spread(Fraction(self._one if same else f.early, f.above + (below - f.below)), self._early).over()
            for f in (a, b)
        )
        return self._atom(x - y if subtract else x + y, a.early if same else None, below)

    def _choice(self, a: Fraction, b: Fraction, x: Fraction, y: Fraction) -> Fraction:
        together = x.below == y.below
        ends = [f.over() if together else f.value() for f in (x, y)]
        operands = (a.value(), b.value(), *ends)
        node = Node("choose", tuple(e.place for e in operands))
        return self._atom(self._tape.put(node), None, x.below if together else None)
