"""A formula as OpenCL: the text of a model's file in kernels/models.

Each operation is done as rarely as possible: what follows from the parameters once for a parameter set
(`model_prepare`), what the incident direction adds once for all view directions that share it
(`model_incident`), and the rest in every direction.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

from clbrdf.models.expression import Expression, Node
from clbrdf.models.formula import Formula
from clbrdf.models.fraction import Early, Fraction, cost, fractions
from clbrdf.models.numeric import needed
from clbrdf.models.parameter import Parameter
from clbrdf.models.sign import POSITIVE_ANGLES, sign

PARAMETERS, INCIDENT, DIRECTION = 1, 2, 3
"""When a node is formed: once a parameter set, once an incident direction, in every direction."""

LONGEST = 70
"""Characters of an expression that is written in place rather than given a name."""

INFIX = {"add": ("+", 1), "subtract": ("-", 1), "multiply": ("*", 2), "divide": ("/", 2)}
CALLS = {
    "sqrt": "sqrt_lanes",
    "exp": "exp_lanes",
    "exp2": "exp2_lanes",
    "log": "log_lanes",
    "log1p": "log1p_lanes",
    "erfcx": "erfcx_lanes",
    "erfcx_raised": "erfcx_raised",
    "sin": "sin",
    "cos": "cos",
    "tan": "tan",
    "atan2": "atan2",
}


VALUE = "\ninline realv model_brdf(const model_state *m, const geometry x) {\n"
FRACTION = (
    "\n// f = what is returned / under; neighbouring directions share a division.\n#define MODEL_DIVIDES\n"
    "inline realv model_fraction(const model_state *m, const geometry x, realv *under) {\n"
)
QUOTIENT = (
    "\ninline realv model_brdf(const model_state *m, const geometry x) {\n    realv under;\n"
    "    const realv over = model_fraction(m, x, &under);\n    return over / under;\n}\n"
)
SIDE_BY_SIDE = ((50.0, 4), (100.0, 2))
"""Directions that a sum takes side by side where a value costs at most so many multiplications, else 1.

More of them overlap where the values are short, and spill registers where they are long
(docs/decisions/0087).
"""


def opencl_text(formula: Formula, rows: Sequence[Parameter], heading: str, plain: bool = False) -> str:
    """Return the OpenCL of a formula whose parameters have a table; `heading` goes on top as a comment.

    `plain` leaves the value as the page forms it, apart from what is hoisted: for a compiler that is to show
    what it makes of it (`clbrdf.bench.peers`).
    """
    writer = _Writer(formula)
    units = [
        slope * leaf if row.scale == "log" else slope
        for row, slope, leaf in zip(rows, formula.gradient, formula.parameters, strict=True)
        if row.linear
    ]
    splits = [_split(writer, slope) for slope in formula.gradient]
    tangents = list({tangent.place: tangent for _, tangent in splits}.values())
    factors = [factor for factor, _ in splits]
    tangent_of = [[t.place for t in tangents].index(tangent.place) for _, tangent in splits]
    whole = fractions([formula.value], writer.early)[0]
    if plain:
        ends = _fewer_divisions(writer, [formula.value])
    else:
        under = whole.under() if _shares_divisions(whole, writer.early) else None
        ends = [whole.value()] if under is None else [under, whole.over()]
        units = [f.value() for f in fractions(units, writer.early)] if units else []
    units = _fewer_divisions(writer, units)
    *tangents, value_beside = _fewer_divisions(writer, [*tangents, formula.value])
    writer.plan([*ends, *tangents, value_beside, *units], factors)
    fields = writer.fields()
    parts = [
        "".join(f"// {line}".rstrip() + "\n" for line in heading.splitlines()),
        "\ntypedef struct {\n"
        + "".join(f"    realv {name};\n" for name in fields or ["none"])
        + "} model_state;\n",
        "\n// What follows from the parameters alone.\ninline model_state model_prepare(const realv *p) {\n",
        "    model_state m;\n" + writer.prepare() + "    return m;\n}\n",
        "\n// What follows from the incident direction, once for all view directions that share it.\n",
        "inline void model_incident(model_state *m, const geometry x) {\n" + writer.incident() + "}\n",
        VALUE + writer.direction(ends, ["return {};"]) + "}\n"
        if len(ends) == 1
        else FRACTION + writer.direction(ends, ["*under = {};", "return {};"]) + "}\n" + QUOTIENT,
        "\n// Directions that a sum takes side by side.\n"
        f"#define MODEL_SIDE_BY_SIDE {_side_by_side(whole, writer.early)}\n",
    ]
    if units:
        parts += [
            "\n// What the linear parameters multiply; for those on a log scale, the product.\n",
            "inline void model_terms(const model_state *m, const geometry x, realv *term) {\n",
            writer.direction(units, [f"term[{k}] = {{}};" for k in range(len(units))]) + "}\n",
        ]
    parts += [
        "\n// f, and ∂f/∂p_j = factor[j] · tangent[tangent_of[j]]; factors do not depend on the view.\n",
        f"#define TANGENTS {len(tangents)}\n",
        f"constant int tangent_of[P] = {{{', '.join(map(str, tangent_of))}}};\n\n",
        "inline realv model_tangents(const model_state *m, const geometry x, realv *tangent) {\n",
        writer.direction(
            [*tangents, value_beside],
            [*(f"tangent[{k}] = {{}};" for k in range(len(tangents))), "return {};"],
        )
        + "}\n",
        "\ninline void model_factors(const model_state *m, realv *factor) {\n",
        writer.direction(factors, [f"factor[{j}] = {{}};" for j in range(len(factors))]) + "}\n",
    ]
    return "".join(parts)


def _shares_divisions(whole: Fraction, early: Early) -> bool:
    """Whether two directions are to share a division: where roots are taken, which need the same unit."""
    under = whole.under()
    ends = [whole.over()] if under is None else [whole.over(), under]
    late = {whole.early.tape.nodes[k].operation for k in needed(ends, {}) if not early(k)}
    return under is not None and "sqrt" in late and "exp2" not in late


def _side_by_side(whole: Fraction, early: Early) -> int:
    paid = cost([whole.value()], early)
    return next((count for most, count in SIDE_BY_SIDE if paid <= most), 1)


def _split(writer: _Writer, slope: Expression) -> tuple[Expression, Expression]:
    """Split a derivative into a factor that is formed before the view direction is known, and the rest."""
    writer.stages([slope])
    early, late, signs = list[Expression](), list[Expression](), [1.0]

    def walk(e: Expression) -> None:
        operands = [Expression(e.tape, k) for k in e.node.operands]
        if writer.stage[e.place] < DIRECTION:
            early.append(e)
        elif e.node.operation == "multiply":
            for operand in operands:
                walk(operand)
        elif e.node.operation == "negative":
            signs[0] = -signs[0]
            walk(operands[0])
        elif e.node.operation == "divide" and writer.stage[operands[1].place] < DIRECTION:
            early.append(1.0 / operands[1])
            walk(operands[0])
        else:
            late.append(e)

    walk(slope)
    one = slope.tape.constant(1.0)
    factor, rest = slope.tape.constant(signs[0]), one
    for e in early:
        factor = factor * e
    for e in sorted(late, key=lambda e: e.place):
        rest = rest * e
    writer.stages([factor, rest])
    return factor, rest


def _fewer_divisions(writer: _Writer, outputs: Sequence[Expression]) -> list[Expression]:
    """Return outputs that multiply by a reciprocal where it is formed early, or serves more than once.

    A division takes as long as some ten multiplications; a reciprocal costs one unit in the last place.
    """
    if not outputs:
        return []
    tape = outputs[0].tape
    writer.stages(outputs)
    plan = needed(outputs, {})
    below = Counter(tape.nodes[k].operands[1] for k in plan if tape.nodes[k].operation == "divide")
    new: dict[int, Expression] = {}
    for place in plan:
        node = tape.nodes[place]
        operands = [new[k] for k in node.operands]
        if node.operation == "divide":
            bottom = node.operands[1]
            early = writer.stage[bottom] < DIRECTION == writer.stage[place]
            shared = below[bottom] > 1
            new[place] = operands[0] * (1.0 / operands[1]) if early or shared else operands[0] / operands[1]
        else:
            new[place] = tape.put(Node(node.operation, tuple(e.place for e in operands), node.value))
    return [new[output.place] for output in outputs]


@dataclass
class _Writer:
    """Writes the functions of one formula."""

    formula: Formula
    stage: dict[int, int] = field(default_factory=dict)
    order: list[int] = field(default_factory=list)
    names: dict[int, str] = field(default_factory=dict)

    @cached_property
    def not_negative(self) -> frozenset[int]:
        """Features that are never below 0."""
        formula = self.formula
        tape = formula.whole.tape
        angles = {tape.leaf(name).place for name in POSITIVE_ANGLES}
        pairs = zip(formula.features, formula.feature_leaves, strict=True)
        return frozenset(leaf.place for whole, leaf in pairs if sign(tape, whole.place, angles) > 0)

    def early(self, place: int) -> bool:
        """Whether a node is formed before the view direction is known."""
        if place not in self.stage:
            self.stages([Expression(self.formula.value.tape, place)])
        return self.stage[place] < DIRECTION

    def stages(self, outputs: Sequence[Expression]) -> None:
        """Decide when each node that the outputs need is formed."""
        nodes = self.formula.value.tape.nodes
        features = {leaf.place: k for k, leaf in enumerate(self.formula.feature_leaves)}
        for place in needed(outputs, {}):
            node = nodes[place]
            if place in features:
                early = features[place] < self.formula.incident_features
                self.stage[place] = INCIDENT if early else DIRECTION
            elif node.operation == "leaf":
                self.stage[place] = PARAMETERS
            else:
                self.stage[place] = max((self.stage[k] for k in node.operands), default=0)

    def plan(self, outputs: Sequence[Expression], factors: Sequence[Expression]) -> None:
        """Decide which nodes are kept from one function to the next, and how they are called."""
        nodes = self.formula.value.tape.nodes
        features = {leaf.place for leaf in self.formula.feature_leaves}
        self.stages([*outputs, *factors])
        self.order = needed([*outputs, *factors], {})
        later: dict[int, int] = {v.place: DIRECTION for v in (*outputs, *factors)}
        for place in self.order:
            for k in nodes[place].operands:
                later[k] = max(later.get(k, 0), self.stage[place])
        taken = {str(leaf.node.value) for leaf in self.formula.parameters}
        for place in self.order:
            stage = self.stage[place]
            if stage in (PARAMETERS, INCIDENT) and later[place] > stage and place not in features:
                self.names[place] = self._new_name(place, taken)

    def fields(self) -> list[str]:
        """Names of what is kept between the functions."""
        return [self.names[place] for place in self.order if place in self.names]

    def prepare(self) -> str:
        """Lines of `model_prepare` between the record and its return."""
        return self._lines(PARAMETERS, "m.")

    def incident(self) -> str:
        """Lines of `model_incident`."""
        return self._lines(INCIDENT, "m->") or "    (void)m;\n    (void)x;\n"

    def direction(self, outputs: Sequence[Expression], statements: Sequence[str]) -> str:
        """Lines that form outputs in a direction, each put into its statement."""
        wanted = set(needed(outputs, dict.fromkeys(self.names)))
        body = _Body(self, wanted, DIRECTION, "m->", [v.place for v in outputs])
        return body.lines([(v.place, s) for v, s in zip(outputs, statements, strict=True)])

    def _lines(self, stage: int, access: str) -> str:
        kept = [place for place in self.order if place in self.names and self.stage[place] == stage]
        given = {place for place in self.names if self.stage[place] < stage}
        if not kept:
            return ""
        outputs = [Expression(self.formula.value.tape, place) for place in kept]
        wanted = set(needed(outputs, dict.fromkeys(given)))
        body = _Body(self, wanted, stage, access, kept)
        return body.lines([(place, f"{access}{self.names[place]} = {{}};") for place in kept])

    def _new_name(self, place: int, taken: set[str]) -> str:
        tape = self.formula.value.tape
        name = tape.names.get(place)
        if name is None or (name in taken and tape.nodes[place].operation != "leaf"):
            name = next(f"s{k}" for k in range(1, 1000) if f"s{k}" not in taken)
        taken.add(name)
        return name


@dataclass
class _Body:
    """The lines of one function."""

    writer: _Writer
    wanted: set[int]
    stage: int
    access: str
    outputs: list[int]
    written: dict[int, tuple[str, int]] = field(default_factory=dict)

    def lines(self, statements: Sequence[tuple[int, str]]) -> str:
        """Return the lines that end in some statements, each with the text of a node put in."""
        nodes = self.writer.formula.value.tape.nodes
        uses: dict[int, int] = {}
        for place in self.wanted:
            for k in nodes[place].operands:
                uses[k] = uses.get(k, 0) + 1
        for place, _ in statements:
            uses[place] = uses.get(place, 0) + 1
        out, count = [], 0
        own = {place: text for place, text in statements if self.stage != DIRECTION}
        names = self.writer.names
        for place in sorted(self.wanted):
            text, rank = self._text(place, nodes[place])
            if place in own:
                out.append("    " + own[place].format(text))
                text, rank = f"{self.access}{names[place]}", 9
            elif nodes[place].operands and (uses[place] > 1 or len(text) > LONGEST):
                count += 1
                out.append(f"    const realv t{count} = {text};")
                text, rank = f"t{count}", 9
            self.written[place] = (text, rank)
        if self.stage == DIRECTION:
            for place, statement in statements:
                text = self._operand(place, 0)
                needs_cast = nodes[place].operation in ("constant", "pi")
                out.append("    " + statement.format(f"(realv){text}" if needs_cast else text))
        return "".join(line + "\n" for line in out)

    def _operand(self, place: int, rank: int) -> str:
        names = self.writer.names
        if place not in self.written and place in names:
            return f"{self.access}{names[place]}"
        text, own = self.written[place]
        return f"({text})" if own < rank else text

    def _text(self, place: int, node: Node) -> tuple[str, int]:
        """Text of a node, and how tightly it binds: 1 sums, 2 products, 3 signs, 9 all else."""
        operation = node.operation
        if operation == "constant":
            value = float(node.value)
            return (f"(real){value!r}", 9) if value >= 0 else (f"(real)({value!r})", 9)
        if operation == "pi":
            return "(real)3.141592653589793", 9
        if operation == "leaf":
            leaves = self.writer.formula.feature_leaves
            if any(leaf.place == place for leaf in leaves):
                return f"x.{node.value}", 9
            return f"p[P_{node.value}]", 9
        if operation in INFIX:
            sign, rank = INFIX[operation]
            left, right = node.operands
            loose = rank if operation in ("add", "multiply") else rank + 1
            return f"{self._operand(left, rank)} {sign} {self._operand(right, loose)}", rank
        if operation == "negative":
            return f"-{self._operand(node.operands[0], 3)}", 2
        if operation == "choose":
            a, b, x, y = (self._operand(k, 2) for k in node.operands)
            return f"({a} < {b} ? (realv){x} : (realv){y})".replace("(realv)(realv)", "(realv)"), 9
        if operation == "exp2" and self._never_positive(node.operands[0]):
            return f"exp2_falling({self._operand(node.operands[0], 0)})", 9
        return f"{CALLS[operation]}({', '.join(self._operand(k, 0) for k in node.operands)})", 9

    def _never_positive(self, place: int) -> bool:
        tape = self.writer.formula.value.tape
        return sign(tape, place, self.writer.not_negative) < 0
