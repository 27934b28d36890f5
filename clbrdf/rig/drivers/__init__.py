"""Drivers, found by the name the rig file gives: one module a maker's part, `DRIVER` its class.

A new part is one new file here that fulfils a protocol of :mod:`clbrdf.rig.roles`.
"""

from __future__ import annotations

import importlib
import pkgutil
from typing import Any

from clbrdf.errors import InputError


def driver_names(role: str) -> tuple[str, ...]:
    """Names of the drivers for a role: "stages", "spectrometer" or "reference"."""
    names = sorted(m.name for m in pkgutil.iter_modules(__path__) if not m.name.endswith("_message"))
    return tuple(name for name in names if role == _module(name).ROLE)


def get_driver(role: str, name: str) -> Any:
    """Return the class of a driver; what it takes and does is in :mod:`clbrdf.rig.roles`.

    Raises
    ------
    InputError
        No driver for this role has the name.
    """
    known = driver_names(role)
    if name not in known:
        raise InputError(f"no driver for {role} is called {name!r}; there are {', '.join(known)}")
    return _module(name).DRIVER


def _module(name: str) -> Any:
    return importlib.import_module(f"{__name__}.{name}")
