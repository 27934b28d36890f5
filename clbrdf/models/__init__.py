"""The models, found by name: each is one module here and one .cl file in kernels/models."""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache

from clbrdf.errors import InputError
from clbrdf.models.model import Model, Parameter

__all__ = ["DEFAULT_MODEL", "Model", "Parameter", "get_model", "model_names"]

DEFAULT_MODEL = "wang2013"


def model_names() -> tuple[str, ...]:
    """Names of all models in this package."""
    modules = (m.name for m in pkgutil.iter_modules(__path__))
    others = ("model", "terms")
    return tuple(sorted(name for name in modules if name not in others and not name.endswith("structure")))


@cache
def get_model(name: str = DEFAULT_MODEL) -> Model:
    """Return a model by its name.

    Raises
    ------
    InputError
        No model has this name.
    """
    if name not in model_names():
        raise InputError(f"no model is called {name!r}; there are {', '.join(model_names())}")
    model = importlib.import_module(f"{__name__}.{name}").MODEL
    assert isinstance(model, Model)
    return model
