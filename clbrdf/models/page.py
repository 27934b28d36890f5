"""What the author of a model writes: a table and one expression, on one page.

For example::

    MODEL = model(
        title="Lambert's cosine law",
        source="…",
        parameters=[linear("rho", "1", 0.5, (0.0, 1.2), "reflectance")],
        value=lambda g, rho: rho / g.pi,
        kind="base",
        flags=RECIPROCAL | BOUNDED,
    )

`g` is the geometry (`clbrdf.models.angles`), and the functions of `clbrdf.models.expression` are those that a
value may call. Values in NumPy, derivatives, the high-precision form and the kernel follow from the
expression. Put brackets around what depends on the geometry alone: it is then formed once on the host, in
double precision.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Flag, auto
from typing import Literal

from clbrdf.models.expression import Expression
from clbrdf.models.parameter import Parameter


class Flags(Flag):
    """What a model promises or needs.

    Attributes
    ----------
    RECIPROCAL
        Exchanging source and detector changes nothing.
    BOUNDED
        The directional-hemispherical reflectance is at most 1 for all parameters within their bounds, or
        at most the parameter that is called a reflectance.
    NEEDS_PHI
        It depends on both azimuths: the surface has a direction of its own.
    SIGNED
        It can be negative.
    NEEDS_WAVELENGTH
        It depends on the wavelength itself, not through its parameters alone.
    """

    NONE = 0
    RECIPROCAL = auto()
    BOUNDED = auto()
    NEEDS_PHI = auto()
    SIGNED = auto()
    NEEDS_WAVELENGTH = auto()


NONE, RECIPROCAL, BOUNDED = Flags.NONE, Flags.RECIPROCAL, Flags.BOUNDED
NEEDS_PHI, SIGNED, NEEDS_WAVELENGTH = Flags.NEEDS_PHI, Flags.SIGNED, Flags.NEEDS_WAVELENGTH

Kind = Literal["lobe", "base", "whole"]
"""A lobe and a base are parts of a surface that add up; a whole surface stands for itself."""


@dataclass(frozen=True)
class Term:
    """A part of a model that can be left out: a summand becomes 0, a factor becomes 1.

    Attributes
    ----------
    name, meaning : str
    parameters : tuple of str
        Parameters that only this term takes.
    factor_of : str
        The summand it is a factor of, "" for a summand.
    base : bool
        Whether it is left out where the model is a part of a sum, which brings a base of its own.
    """

    name: str
    meaning: str
    parameters: tuple[str, ...] = ()
    factor_of: str = ""
    base: bool = False


@dataclass(frozen=True, eq=False)
class Example:
    """A published or independently computed value, for the model's own test.

    Attributes
    ----------
    parameters : mapping of str to float
    angles : (float, float, float)
        θi, θr, φ, degrees.
    value : float
        1/sr.
    source : str
        Who says so.
    """

    parameters: Mapping[str, float]
    angles: tuple[float, float, float]
    value: float
    source: str


@dataclass(frozen=True, eq=False)
class Page:
    """A model as its author wrote it; see `model`."""

    title: str
    source: str
    parameters: tuple[Parameter, ...]
    value: Callable[..., Expression]
    kind: Kind
    flags: Flags
    terms: tuple[Term, ...]
    grazing: tuple[str, ...]
    examples: tuple[Example, ...]
    name: str = ""
    file: str = ""
    """Path of a page of one's own, "" for those that are found by name."""


def model(
    *,
    title: str,
    source: str,
    parameters: Sequence[Parameter],
    value: Callable[..., Expression],
    kind: Kind = "lobe",
    flags: Flags = NONE,
    terms: Sequence[Term] = (),
    grazing: Sequence[str] = (),
    examples: Sequence[Example] = (),
    name: str = "",
) -> Page:
    """Return a model's page.

    Parameters
    ----------
    title, source : str
        What it is, and where it is published (a DOI where there is one).
    parameters : sequence of Parameter
        The table, by `linear`, `shape`, `log_shape` and `given`.
    value : callable
        ``(g, *parameters)`` -> expression of the BRDF, 1/sr, without the cosine. A model with `terms` is
        called with ``left_out=frozenset of names`` as well.
    kind : "lobe", "base" or "whole"
    flags : Flags
    terms : sequence of Term
    grazing : sequence of str
        Linear parameters whose part has no finite integral over the hemisphere.
    examples : sequence of Example
    name : str
        Where the page is not a file of its own, whose name it then takes.
    """
    return Page(
        title=title,
        source=source,
        parameters=tuple(parameters),
        value=value,
        kind=kind,
        flags=flags,
        terms=tuple(terms),
        grazing=tuple(grazing),
        examples=tuple(examples),
        name=name,
    )


def linear(
    name: str,
    unit: str,
    default: float,
    bounds: tuple[float, float],
    meaning: str,
    *,
    log_floor: float | None = None,
) -> Parameter:
    """Return the row of a parameter in which the BRDF is linear; with a floor it moves on a log scale."""
    if log_floor is None:
        return Parameter(name, unit, default, bounds, meaning, linear=True)
    return Parameter(name, unit, default, bounds, meaning, "log", log_floor, linear=True)


def shape(name: str, unit: str, default: float, bounds: tuple[float, float], meaning: str) -> Parameter:
    """Return the row of a parameter that does not enter linearly."""
    return Parameter(name, unit, default, bounds, meaning)


def log_shape(
    name: str,
    unit: str,
    default: float,
    bounds: tuple[float, float],
    meaning: str,
    *,
    log_floor: float = 0.0,
) -> Parameter:
    """Return the row of a parameter that does not enter linearly and spans decades."""
    return Parameter(name, unit, default, bounds, meaning, "log", log_floor)


def constant(name: str, unit: str, default: float, bounds: tuple[float, float], meaning: str) -> Parameter:
    """Return the row of a parameter that a fit needs to be told, such as an optical constant."""
    return Parameter(name, unit, default, bounds, meaning, given="user")


def wavelength_in_nm() -> Parameter:
    """Return the row of the wavelength itself, for models that need it."""
    return Parameter(
        "wavelength", "nm", 550.0, (10.0, 1e6), "wavelength in vacuum, from the scan", given="wavelength"
    )
