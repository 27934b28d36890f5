"""A formula as JavaScript, in doubles: what a page in a browser computes with.

The text is an object of four functions, printed from the same record as the OpenCL kernel. They use `ln` and
`erfcx` of viz/page/special.js beside what the language has.

    features(a, x, k)   from the angles a (an object, by name) to features, put to x[k], x[k + 1], …
    value(p)            from parameters to a function (x, k) -> f; what follows from them is done once
    slopes(p)           from parameters to a function (x, k, d) -> f, which puts ∂f/∂p_j to d[j]
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from clbrdf.models.expression import Expression, Node
from clbrdf.models.formula import Formula
from clbrdf.models.numeric import needed

LONGEST = 80
"""Characters of an expression that is written in place rather than given a name."""

INFIX = {"add": ("+", 1), "subtract": ("-", 1), "multiply": ("*", 2), "divide": ("/", 2)}
CALLS = {
    "sqrt": "Math.sqrt",
    "exp": "Math.exp",
    "log": "ln",
    "log1p": "Math.log1p",
    "erfcx": "erfcx",
    "sin": "Math.sin",
    "cos": "Math.cos",
    "tan": "Math.tan",
    "atan2": "Math.atan2",
}


def javascript_text(formula: Formula) -> str:
    """Return an expression of JavaScript whose value is an object of the functions above."""
    whole = formula.whole.tape
    angles = {
        place: f"a.{whole.nodes[place].value}"
        for place in (needed(formula.features, {}) if formula.features else ())
        if whole.nodes[place].operation == "leaf"
    }
    given = {leaf.place: f"p[{j}]" for j, leaf in enumerate(formula.parameters)}
    given |= {leaf.place: _element("k", j) for j, leaf in enumerate(formula.feature_leaves)}
    late = {leaf.place for leaf in formula.feature_leaves}
    features = [f"{_element('k', j)} = {{}};" for j in range(len(formula.features))]
    slopes = [f"d[{j}] = {{}};" for j in range(len(formula.gradient))]
    return (
        "({\n"
        f"  features(a, x, k) {{\n{_lines(formula.features, features, angles, '    ')}  }},\n"
        f"  value(p) {{\n{_closure([formula.value], ['return {};'], given, late, '(x, k)')}  }},\n"
        f"  slopes(p) {{\n"
        f"{_closure([*formula.gradient, formula.value], [*slopes, 'return {};'], given, late, '(x, k, d)')}"
        "  },\n})"
    )


def _element(place: str, offset: int) -> str:
    return f"x[{place} + {offset}]" if offset else f"x[{place}]"


def _closure(
    outputs: Sequence[Expression],
    statements: Sequence[str],
    given: Mapping[int, str],
    late: set[int],
    arguments: str,
) -> str:
    """Return the lines of a function that does once what does not depend on the late leaves."""
    nodes = outputs[0].tape.nodes
    plan = needed(outputs, {})
    depends = set(late)
    depends.update(place for place in plan if place in late)
    for place in plan:
        if any(k in depends for k in nodes[place].operands):
            depends.add(place)
    uses = {k for place in plan if place in depends for k in nodes[place].operands}
    uses |= {output.place for output in outputs}
    kept = [place for place in plan if place in uses and place not in depends and nodes[place].operands]
    early = [Expression(outputs[0].tape, place) for place in kept]
    names = {place: f"s{n + 1}" for n, place in enumerate(kept)}
    head = _lines(early, [f"const {names[place]} = {{}};" for place in kept], given, "    ", names)
    body = _lines(outputs, statements, {**given, **names}, "      ")
    return f"{head}    return {arguments} => {{\n{body}    }};\n"


def _lines(
    outputs: Sequence[Expression],
    statements: Sequence[str],
    given: Mapping[int, str],
    indent: str,
    own: Mapping[int, str] | None = None,
) -> str:
    """Return lines that form outputs, each put into its statement.

    `own` names outputs that later ones may use once their statement is written.
    """
    if not outputs:
        return ""
    nodes = outputs[0].tape.nodes
    plan = needed(outputs, dict.fromkeys(given))
    writer = _Writer(given)
    uses: dict[int, int] = {}
    for place in plan:
        for k in nodes[place].operands:
            uses[k] = uses.get(k, 0) + 1
    out, statement_of = [], {}
    if own:
        statement_of = {output.place: s for output, s in zip(outputs, statements, strict=True)}
    for place in plan:
        text, rank = writer.text(nodes[place])
        if own and place in statement_of:
            out.append(indent + statement_of[place].format(text))
            text, rank = own[place], 9
        elif nodes[place].operands and (uses.get(place, 0) > 1 or len(text) > LONGEST):
            writer.count += 1
            out.append(f"{indent}const t{writer.count} = {text};")
            text, rank = f"t{writer.count}", 9
        writer.written[place] = (text, rank)
    if not own:
        for output, statement in zip(outputs, statements, strict=True):
            out.append(indent + statement.format(writer.operand(output.place, 0)))
    return "".join(line + "\n" for line in out)


@dataclass
class _Writer:
    """Texts of nodes, with how tightly each binds: 1 sums, 2 products, 3 signs, 9 all else."""

    given: Mapping[int, str]
    written: dict[int, tuple[str, int]] = field(default_factory=dict)
    count: int = 0

    def operand(self, place: int, rank: int) -> str:
        """Return the text of an operand, in brackets where it binds less tightly than a rank."""
        if place in self.given:
            return self.given[place]
        text, own = self.written[place]
        return f"({text})" if own < rank else text

    def text(self, node: Node) -> tuple[str, int]:
        """Return the text of a node whose operands are written."""
        operation = node.operation
        if operation == "constant":
            value = float(node.value)
            return (repr(value), 9) if value >= 0.0 else (f"({value!r})", 9)
        if operation == "pi":
            return "Math.PI", 9
        if operation == "leaf":
            raise KeyError(f"no text is given for {node.value!r}")
        if operation in INFIX:
            sign, rank = INFIX[operation]
            left, right = node.operands
            # Never regrouped: rounding is to be that of the other forms.
            return f"{self.operand(left, rank)} {sign} {self.operand(right, rank + 1)}", rank
        if operation == "negative":
            return f"-{self.operand(node.operands[0], 3)}", 2
        if operation == "choose":
            a, b, x, y = (self.operand(k, 2) for k in node.operands)
            return f"({a} < {b} ? {x} : {y})", 9
        return f"{CALLS[operation]}({', '.join(self.operand(k, 0) for k in node.operands)})", 9
