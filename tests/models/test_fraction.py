"""Formulas rewritten for the inner loop: the same quantity, with fewer divisions; what is known of signs."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clbrdf.models import get_model, model_names
from clbrdf.models.expression import Tape, exp, greatest, sqrt
from clbrdf.models.fraction import cost, fractions
from clbrdf.models.numeric import NUMPY, expression_values, mpmath_operations, needed
from clbrdf.models.sign import sign

LOG_2 = mp.log(2)

NAMES = ("p", "q", "x", "y", "z")
"""The first two are parameters, the others change with the view direction."""


def operations(known):
    """Operations in some arithmetic, with those that only kernels have."""
    base = dict(known)
    return base | {
        "exp2": lambda a: base["exp"](a * LOG_2),
        "erfcx_raised": lambda a: (1 + 2 * a) * base["erfcx"](a),
    }


@st.composite
def formulas(draw):
    """A formula of quantities in [½, 2] without differences, whose parts then stay in that order of size."""
    tape = Tape()
    parts = [tape.leaf(name) for name in NAMES] + [tape.constant(1.5), tape.constant(-0.5)]
    for _ in range(draw(st.integers(1, 12))):
        a, b = (parts[draw(st.integers(0, len(parts) - 1))] for _ in range(2))
        operation = draw(st.sampled_from("+*/s-ew"))
        if operation == "s":
            parts.append(sqrt(a * a + 1.0))
        elif operation == "e":
            parts.append(exp(-(a * a) / (a * a + 1.0)))
        elif operation == "-":
            parts.append(-a)
        elif operation == "w":
            parts.append(greatest(a, b) / (b * b + 1.0))
        else:
            parts.append({"+": a * a + b * b, "*": a * b, "/": a / (b * b + 0.5)}[operation])
    return tape, parts[-1]


def early_of(tape, late):
    """Whether a node does not follow from some leaves."""

    def early(place):
        node = tape.nodes[place]
        return place not in late and all(early(k) for k in node.operands)

    return early


@given(formulas(), st.lists(st.floats(0.5, 2.0), min_size=len(NAMES), max_size=len(NAMES)))
def test_a_rewritten_formula_is_the_same_quantity(formula, values):
    tape, value = formula
    leaves = [tape.leaf(name).place for name in NAMES]
    early = early_of(tape, set(leaves[2:]))
    (fraction,) = fractions([value], early)
    with mp.workdps(60):
        numbers = {place: mp.mpf(v) for place, v in zip(leaves, values, strict=True)}
        known = operations(mpmath_operations())
        (right,) = expression_values([value], numbers, known)
        (ours,) = expression_values([fraction.value()], numbers, known)
        # log2 e is rounded to a double: the exponents here are below 1.
        assert abs(ours - right) <= mp.mpf("1e-14") * abs(right)
    assert early(fraction.early.place)
    assert cost([fraction.value()], early) <= cost([value], early) + 30.0


def divisions(values, early):
    nodes = values[0].tape.nodes
    return sum(nodes[k].operation == "divide" for k in needed(values, {}) if not early(k))


@pytest.mark.parametrize(
    ("name", "most"),
    # All that is left are those that a root, an exponential or a condition asks for.
    [("ggx", 1), ("ggx_dielectric", 1), ("ggx_conductor", 3), ("abg", 1), ("rpv", 1), ("ggx+minnaert", 1)],
)
def test_divisions_are_brought_together(name, most):
    formula = get_model(name).formula
    leaves = {leaf.place for leaf in formula.feature_leaves[formula.incident_features :]}
    early = early_of(formula.value.tape, leaves)
    (fraction,) = fractions([formula.value], early)
    assert divisions([fraction.value()], early) <= most


def test_a_factor_goes_into_the_sum_that_it_multiplies():
    tape = Tape()
    p, q, x, y = (tape.leaf(name) for name in "pqxy")
    early = early_of(tape, {x.place, y.place})
    (fraction,) = fractions([p * (q * x + 2.0 * y)], early)
    assert cost([fraction.value()], early) == 3.0  # (p q) x + (2 p) y


@pytest.mark.parametrize("name", model_names())
def test_signs_hold_on_every_model(name):
    model = get_model(name)
    formula, rng = model.formula, np.random.default_rng(4)
    tape = formula.value.tape
    parameters = np.array([rng.uniform(*p.bounds, 200) for p in model.parameters])
    x = np.abs(rng.standard_normal((200, len(model.feature_names))))
    given = dict(zip((leaf.place for leaf in formula.parameters), parameters, strict=True))
    given |= {leaf.place: x[:, k] for k, leaf in enumerate(formula.feature_leaves)}
    features = {leaf.place for leaf in formula.feature_leaves}
    places = [k for k in needed([formula.value], {}) if tape.nodes[k].operands]
    with np.errstate(all="ignore"):
        for k in places:
            (values,) = expression_values([type(formula.value)(tape, k)], given, NUMPY)
            found = sign(tape, k, features)
            values = np.asarray(values)[np.isfinite(values)]
            assert (found * values >= 0.0).all(), tape.nodes[k]
