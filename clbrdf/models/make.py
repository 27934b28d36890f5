"""From pages to models: one page, a page without some of its terms, or a sum of such parts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.geometry import Directions
from clbrdf.models.angles import Geometry
from clbrdf.models.expression import Expression, Tape
from clbrdf.models.formula import Formula, depends_on, take_apart
from clbrdf.models.kernel import opencl_text
from clbrdf.models.model import Model
from clbrdf.models.page import Flags, Page, Term
from clbrdf.models.parameter import Parameter

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class ModelPart:
    """A page in a model: under which name, and without which of its terms.

    Attributes
    ----------
    key : str
        Before the dot of its parameters' names; "" where the model is this page alone.
    page : Page
    left_out : frozenset of str
        Terms, by their names.
    """

    key: str
    page: Page
    left_out: frozenset[str] = frozenset()

    @property
    def gone(self) -> frozenset[str]:
        """Terms that are left out; a factor goes with the summand that it belongs to."""
        return frozenset(
            t.name for t in self.page.terms if t.name in self.left_out or t.factor_of in self.left_out
        )

    @property
    def rows(self) -> tuple[Parameter, ...]:
        """The rows of the page's table that are left, under the part's name."""
        absent = {name for term in self.page.terms if term.name in self.gone for name in term.parameters}
        prefix = f"{self.key}." if self.key else ""
        rows = (row for row in self.page.parameters if row.name not in absent)
        return tuple(replace(row, name=prefix + row.name) for row in rows)

    def value(self, g: Geometry, leaves: Sequence[Expression]) -> Expression:
        """Record the value; parameters that are gone have no say in it."""
        given = iter(leaves)
        absent = {name for term in self.page.terms if term.name in self.gone for name in term.parameters}
        zero = g.tape.constant(0.0)
        values = [zero if row.name in absent else next(given) for row in self.page.parameters]
        if not self.page.terms:
            return self.page.value(g, *values)
        return self.page.value(g, *values, left_out=self.gone)


def make_model(name: str, origin: str, parts: Sequence[ModelPart]) -> Model:
    """Return the model of some parts, which add up.

    Raises
    ------
    InputError
        A page whose value is not linear in a parameter that its table calls linear.
    """
    rows = tuple(row for part in parts for row in part.rows)

    def record(g: Geometry, leaves: Sequence[Expression]) -> Expression:
        total, first = g.tape.constant(0.0), 0
        for part in parts:
            count = len(part.rows)
            total = total + part.value(g, leaves[first : first + count])
            first += count
        return total

    formula = take_apart(record, [row.symbol for row in rows])
    _check_linear(name, formula, rows)
    tape = Tape()
    zero = tape.constant(0.0)
    nothing = record(Geometry(tape), [zero if row.linear else tape.leaf(row.symbol) for row in rows])
    title = "; ".join(dict.fromkeys(part.page.title for part in parts))
    source = "; ".join(dict.fromkeys(part.page.source for part in parts))

    def features(directions: Directions, dtype: type[np.floating] = np.float64) -> Array:
        with np.errstate(over="ignore"):  # fp32 holds what a fast precision can use
            return formula.features_at(directions).astype(dtype, copy=False)

    @cache
    def kernel() -> str:
        return opencl_text(formula, rows, f"{name}: {title}\nsource: {source}")

    def quiet(values: Any) -> Any:
        def run(parameters: Array, x: Array) -> Array:
            with np.errstate(all="ignore"):  # what overflows is infinite, and is told from a value by that
                out: Array = values(parameters, x)
            return out

        return run

    return Model(
        name=name,
        origin=origin,
        title=title,
        source=source,
        parameters=rows,
        feature_names=formula.feature_names,
        incident_features=formula.incident_features,
        features=features,
        brdf=quiet(formula.values),
        jacobian=quiet(formula.jacobian),
        reference=formula.reference,
        kernel=kernel,
        formula=formula,
        kind=parts[0].page.kind if len(parts) == 1 else "whole",
        flags=_flags(parts),
        terms=_terms(parts),
        examples=parts[0].page.examples if len(parts) == 1 and not parts[0].gone else (),
        grazing=tuple(
            row.name for part in parts for row in part.rows if row.name.split(".")[-1] in part.page.grazing
        ),
        homogeneous=nothing.constant == 0.0,
        equal_parts=_equal(parts),
    )


def _check_linear(name: str, formula: Formula, rows: Sequence[Parameter]) -> None:
    linear = [(row, leaf) for row, leaf in zip(rows, formula.parameters, strict=True) if row.linear]
    for row, slope in zip(rows, formula.gradient, strict=True):
        for other, leaf in linear:
            if row.linear and depends_on(slope, leaf):
                raise InputError(
                    f"model {name}: the value is not linear in {row.name} and {other.name} together;"
                    " give one of them by shape or log_shape"
                )


def _flags(parts: Sequence[ModelPart]) -> Flags:
    """All promise what each promises; each adds its needs. Bounded parts do not make a bounded sum."""
    promises = Flags.RECIPROCAL | Flags.BOUNDED if len(parts) == 1 else Flags.RECIPROCAL
    needs = Flags.NONE
    for part in parts:
        promises &= part.page.flags
        needs |= part.page.flags & (Flags.NEEDS_PHI | Flags.SIGNED | Flags.NEEDS_WAVELENGTH)
    return promises | needs


def _terms(parts: Sequence[ModelPart]) -> tuple[Term, ...]:
    """Return what can be left out: the terms of a page, or the parts of a sum and their terms."""
    out = []
    for part in parts:
        prefix = f"{part.key}." if part.key else ""
        if len(parts) > 1:
            out.append(Term(part.key, part.page.title, tuple(row.name for row in part.rows)))
        for term in part.page.terms:
            if term.name not in part.gone:
                owner = term.factor_of or ("" if len(parts) == 1 else part.key)
                owner = prefix + owner if term.factor_of else owner
                names = tuple(prefix + name for name in term.parameters)
                out.append(replace(term, name=prefix + term.name, parameters=names, factor_of=owner))
    return tuple(out)


def _equal(parts: Sequence[ModelPart]) -> tuple[tuple[tuple[int, ...], ...], ...]:
    """Return sets of parts that are the same page, by the places of their parameters."""
    sets: dict[tuple[str, frozenset[str]], list[tuple[int, ...]]] = {}
    first = 0
    for part in parts:
        count = len(part.rows)
        sets.setdefault((part.page.name, part.gone), []).append(tuple(range(first, first + count)))
        first += count
    return tuple(tuple(places) for places in sets.values() if len(places) > 1)
