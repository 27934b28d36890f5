"""The methods of a fit, by name. All of them hand starts to the same polish."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Any, Literal

from clbrdf.errors import InputError
from clbrdf.fit import anneal, dictionary, lookup, tempering
from clbrdf.fit.anneal import AnnealSettings
from clbrdf.fit.dictionary import DictionarySettings
from clbrdf.fit.lookup import LookupSettings
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
    needs : "", "linear" or "structure"
        Works only for models with linear parameters, or with a `Structure`, all of whose parameters are
        free.
    search : callable
        Problem, settings, seed, report -> Candidates.
    cheaper : tuple of (str, settings)
        Shorter searches, in words and settings, the cheapest first.
    """

    name: str
    settings: type[Any]
    needs: Literal["", "linear", "structure"]
    search: Callable[[Problem, Any, int, Report], Candidates]
    cheaper: tuple[tuple[str, Any], ...]


SHORT_DICTIONARY = (
    ("dictionary alone", DictionarySettings(starts=1, deepen=False, polish="none")),
    ("dictionary, 8 starts in single precision", DictionarySettings(deepen=False, polish="single")),
    ("dictionary, 4 starts", DictionarySettings(starts=4, deepen=False)),
    ("dictionary, 8 starts, one look", DictionarySettings(deepen=False)),
)

SHORT_LOOKUP = (
    ("look-up alone", LookupSettings(starts=1, deepen=False, polish="none")),
    ("look-up, 12 starts in single precision", LookupSettings(deepen=False, polish="single")),
    ("look-up, 4 starts", LookupSettings(starts=4, deepen=False)),
    ("look-up, 12 starts, one look", LookupSettings(deepen=False)),
)

# Shorter chains miss an optimum too rarely for a sample to tell, and then by far.
SHORT_ANNEALING = (("32 chains × 300 sweeps", AnnealSettings(chains=32, levels=15)),)

SHORT_TEMPERING = (("2 ladders × 40 rounds", TemperingSettings(ladders=2, rounds=40)),)

METHODS = {
    method.name: method
    for method in (
        Method("dictionary", DictionarySettings, "structure", dictionary.search, SHORT_DICTIONARY),
        Method("lookup", LookupSettings, "", lookup.search, SHORT_LOOKUP),
        Method("anneal-separable", AnnealSettings, "linear", anneal.search_separable, SHORT_ANNEALING),
        Method("tempering", TemperingSettings, "", tempering.search, SHORT_TEMPERING),
        Method("anneal", AnnealSettings, "", anneal.search, SHORT_ANNEALING),
    )
}

METHOD_NAMES = ("auto", *METHODS)


def get_method(name: str, model: Model, settings: Any = None, given: Collection[str] = frozenset()) -> Method:
    """Return a method by its name.

    "auto" is the fastest that reaches the optimum of the model, or the one that takes the settings; `given`
    are the parameters that are not fitted.

    Raises
    ------
    InputError
        No method has this name, it does not take these settings, or it needs of the model what that does not
        have.
    """
    able = {"", *("linear" for j in model.linear if model.names[j] not in given)}
    if model.structure is not None and not given:
        able.add("structure")
    if name == "auto" and settings is None:
        return METHODS["dictionary" if "structure" in able else "lookup"]
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
    if method.needs not in able:
        lack = "linear parameters that are free" if method.needs == "linear" else "a dictionary of lobes"
        raise InputError(f"method {name} needs {lack}, and model {model.name} has none; use method 'lookup'")
    return method
