"""The methods of a fit, by name. All of them hand starts to the same polish."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from clbrdf.errors import InputError
from clbrdf.fit import anneal, dictionary, tempering
from clbrdf.fit.problem import Candidates, Problem
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
    """

    name: str
    settings: type[Any]
    needs_structure: bool
    search: Callable[[Problem, Any, int, Report], Candidates]


METHODS = {
    method.name: method
    for method in (
        Method("dictionary", dictionary.DictionarySettings, True, dictionary.search),
        Method("anneal-separable", anneal.Settings, True, anneal.search_separable),
        Method("tempering", tempering.TemperingSettings, False, tempering.search),
        Method("anneal", anneal.Settings, False, anneal.search),
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
