"""The methods of a fit, by name. All of them hand starts to the same polish."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from clbrdf.errors import InputError
from clbrdf.fit import anneal, dictionary, tempering
from clbrdf.fit.anneal import Settings
from clbrdf.fit.dictionary import DictionarySettings
from clbrdf.fit.problem import Candidates, Problem
from clbrdf.fit.tempering import TemperingSettings
from clbrdf.models import Model
from clbrdf.progress import Report


@dataclass(frozen=True)
class Method:
    """A way to find starts for the polish.

    Attributes
    ----------
    name : str
    settings : type
        Of its settings, made with no arguments where the user gives none. Has `starts`, the number of
        starts of the polish; `deeper()`, settings of a second look or None; and
        `cost(directions, parameters)`, the bytes and the model evaluations of one launch that one
        wavelength takes on the device.
    needs_structure : bool
        Works for models with a `Structure` only.
    search : callable
        Problem, settings, seed, report -> Candidates.
    cheaper : tuple of (str, settings)
        Shorter searches, in words and settings, the cheapest first.
    """

    name: str
    settings: type[Any]
    needs_structure: bool
    search: Callable[[Problem, Any, int, Report], Candidates]
    cheaper: tuple[tuple[str, Any], ...]


SHORT_DICTIONARY = (
    ("dictionary alone", DictionarySettings(starts=1, deepen=False, polish="none")),
    ("dictionary, 8 starts in single precision", DictionarySettings(deepen=False, polish="single")),
    ("dictionary, 4 starts", DictionarySettings(starts=4, deepen=False)),
    ("dictionary, 8 starts, one look", DictionarySettings(deepen=False)),
)

# Shorter chains miss an optimum too rarely for a sample to tell, and then by far.
SHORT_ANNEALING = (("32 chains × 300 sweeps", Settings(chains=32, levels=15)),)

SHORT_TEMPERING = (("2 ladders × 40 rounds", TemperingSettings(ladders=2, rounds=40)),)

METHODS = {
    method.name: method
    for method in (
        Method("dictionary", DictionarySettings, True, dictionary.search, SHORT_DICTIONARY),
        Method("anneal-separable", Settings, True, anneal.search_separable, SHORT_ANNEALING),
        Method("tempering", TemperingSettings, False, tempering.search, SHORT_TEMPERING),
        Method("anneal", Settings, False, anneal.search, SHORT_ANNEALING),
    )
}

METHOD_NAMES = ("auto", *METHODS)


def get_method(name: str, model: Model, settings: Any = None) -> Method:
    """Return a method by its name.

    "auto" is the fastest that reaches the optimum of the model, or the one that takes the settings.

    Raises
    ------
    InputError
        No method has this name, it does not take these settings, or it needs a structure that the model
        does not have.
    """
    if name == "auto" and settings is None:
        return METHODS["anneal" if model.structure is None else "dictionary"]
    if name == "auto":
        takers = [method for method in METHODS.values() if isinstance(settings, method.settings)]
        if not takers:
            raise InputError(f"no method takes settings of type {type(settings).__name__}")
        return takers[-1]  # of the two that anneal, the one for every model
    if name not in METHODS:
        raise InputError(f"no method is called {name!r}; there are {', '.join(METHOD_NAMES)}")
    method = METHODS[name]
    if settings is not None and not isinstance(settings, method.settings):
        raise InputError(f"method {name} takes {method.settings.__name__}, not {type(settings).__name__}")
    if method.needs_structure and model.structure is None:
        raise InputError(f"method {name} cannot split model {model.name}; use method 'anneal'")
    return method
