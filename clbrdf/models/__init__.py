"""Reflectance models by name: single pages, pages without some of their terms, and sums.

get_model("ggx")                     one page
get_model("wang2013-fresnel")        without the term fresnel
get_model("ggx+minnaert")            parameters ggx.alpha, …, minnaert.rho, minnaert.k
get_model("abg+abg+lambert")         abg1.b0, …, abg2.b0, …, lambert.rho
get_model("wang2013+eon")            the lobe of wang2013 with another base: its own is left out
"""

from __future__ import annotations

import importlib
from collections import Counter
from dataclasses import replace
from functools import cache
from importlib import resources
from typing import Any

from clbrdf.errors import InputError, advice
from clbrdf.models import library, tuned
from clbrdf.models.find import find_page, own_names, page_names
from clbrdf.models.make import ModelPart, make_model
from clbrdf.models.model import Model
from clbrdf.models.page import (
    BOUNDED,
    NEEDS_PHI,
    NEEDS_WAVELENGTH,
    RECIPROCAL,
    SIGNED,
    Example,
    Flags,
    Page,
    Term,
    constant,
    linear,
    log_shape,
    model,
    shape,
    wavelength_in_nm,
)
from clbrdf.models.parameter import Parameter

__all__ = [
    "BOUNDED",
    "DEFAULT_MODEL",
    "NEEDS_PHI",
    "NEEDS_WAVELENGTH",
    "RECIPROCAL",
    "SIGNED",
    "Example",
    "Flags",
    "Model",
    "Page",
    "Parameter",
    "Term",
    "constant",
    "get_model",
    "library",
    "linear",
    "log_shape",
    "model",
    "model_names",
    "remade",
    "restrict",
    "shape",
    "wavelength_in_nm",
    "written_kernel",
]

DEFAULT_MODEL = "wang2013"


def model_names() -> tuple[str, ...]:
    """Names of all single models that are found without a path."""
    return page_names()


def get_model(name: str | Model | Page = DEFAULT_MODEL, *, force: bool = False) -> Model:
    """Return a model by its name, as the head of this module tells; a model as it is; a page's own model.

    Parameters
    ----------
    name : str, Model or Page
    force : bool
        Allow sums of whole surfaces, such as hapke+rpv.

    Raises
    ------
    InputError
        No model has this name, a page has no such term, nothing is left, or a sum adds up whole surfaces.
    """
    if isinstance(name, Model):
        return name
    if isinstance(name, Page):
        return _of_page(name)
    if not isinstance(name, str):
        raise InputError(f"a model is asked for by its name, not by {type(name).__name__}")
    pieces = [_piece(text.strip()) for text in name.split("+")]
    whole = [page.name for page, _ in pieces if page.kind == "whole" and not any(t.base for t in page.terms)]
    if len(whole) > 1 and not force:
        raise InputError(
            f"model {name!r} adds up whole surfaces ({', '.join(whole)}); take one of them, or"
            f" {advice('get_model(name, force=True)', '--force')}"
        )
    return _model(tuple(pieces))


def remade(origin: str) -> Model:
    """Return a model that has been made before, from its `origin`: in another process, or from a file."""
    return get_model(origin, force=True)


def restrict(whole: Model, left_out: frozenset[str]) -> Model:
    """Return a model without some of its terms, which may be the parts of a sum.

    Raises
    ------
    InputError
        Nothing is left.
    """
    if not left_out:
        return whole
    terms = {term.name for term in whole.terms}
    unknown = sorted(left_out - terms)
    if unknown:
        raise InputError(f"model {whole.name} has no term {unknown[0]!r}; it has {', '.join(sorted(terms))}")
    texts, pieces = whole.origin.split("+"), []
    for key, text in zip(_keys([_piece(text) for text in texts]), texts, strict=True):
        own = sorted(
            name.removeprefix(f"{key}.") if key else name for name in left_out if _belongs(name, key)
        )
        pieces.append("-".join([text, *(text.split("-")[0] if name == key else name for name in own)]))
    return get_model("+".join(pieces), force=True)


def _belongs(term: str, key: str) -> bool:
    return not key or term == key or term.startswith(f"{key}.")


Piece = tuple[Page, frozenset[str]]


def _piece(text: str) -> Piece:
    """Return the page of one summand and what is left out of it; its own name says all of it."""
    name, *left_out = (part.strip() for part in (text.split("-") if not text.endswith(".py") else [text]))
    page = find_page(name)
    terms = {term.name for term in page.terms}
    for term in left_out:
        if term not in terms and term != page.name:
            known = f"it has {', '.join(sorted(terms))}" if terms else "it has none"
            raise InputError(f"model {page.name} has no term {term!r} to leave out; {known}")
    return page, frozenset(left_out)


def _keys(pieces: list[Piece]) -> list[str]:
    """Return names of the summands: numbered where a page occurs twice, "" where there is only one."""
    if len(pieces) == 1:
        return [""]
    counts, seen, keys = Counter(page.name for page, _ in pieces), Counter[str](), []
    for page, _ in pieces:
        seen[page.name] += 1
        keys.append(f"{page.name}{seen[page.name]}" if counts[page.name] > 1 else page.name)
    return keys


@cache
def _model(pieces: tuple[Piece, ...]) -> Model:
    parts = []
    for key, (page, left_out) in zip(_keys(list(pieces)), pieces, strict=True):
        base = {term.name for term in page.terms if term.base} if len(pieces) > 1 else set()
        part = ModelPart(key, page, left_out | base)
        if page.name not in left_out and part.rows:
            parts.append(part)
    name = "+".join("-".join([page.name, *sorted(left_out)]) for page, left_out in pieces)
    if not parts:
        raise InputError(f"model {name!r} leaves nothing that reflects; keep one of its terms")
    origin = "+".join("-".join([page.file or page.name, *sorted(gone)]) for page, gone in pieces)
    made = make_model(name, origin, parts)
    page, left_out = pieces[0]
    if len(pieces) == 1 and not left_out and page.name in own_names():
        made = replace(made, **_of_this_package(page.name))
    return made


@cache
def _of_page(page: Page) -> Model:
    if not page.name:
        raise InputError("a page that is given as it is needs a name: model(..., name='phong')")
    return _model(((page, frozenset()),))


def written_kernel(name: str) -> str:
    """Return what stands in kernels/models for a page of this package that is not tuned.

    A test holds the file to it; `make kernels` writes the file.
    """
    made = make_model(name, name, [ModelPart("", find_page(name))])
    return f"// Written by 'make kernels' from clbrdf/models/library/{name}.py.\n{made.kernel()}"


def _of_this_package(name: str) -> dict[str, Any]:
    """Return the kernel as it stands in kernels/models, and what a tuned model does better."""
    file = resources.files("clbrdf.kernels").joinpath(f"models/{name}.cl")
    fields: dict[str, Any] = {"kernel": lambda: file.read_text(encoding="utf-8")}
    if name in tuned.NAMES:
        fields |= importlib.import_module(f"{tuned.__name__}.{name}").TUNED
    return fields
