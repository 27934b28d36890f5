"""Drivers, found by the name the rig file gives: one module a maker's part.

A new part is one new file here. It says

`ROLES`
    which parts of the rig it can play: "stages", "spectrometer", "reference";
`connect`
    for a spectrometer or a reference detector `connect(settings, context)`, for stages
    `connect(settings, axes, context)` with the settings of the axes by name; returns what
    :mod:`clbrdf.rig.roles` describes, not yet open;
`Connection`
    the keys it needs in its section of the rig file (none if missing), `CONNECTIONS` where they differ by
    role, and for stages `Axis`, those of each axis;
`EXTRA`
    the extra of this package that it needs, where it needs one;
`find`
    what is connected to this computer: a list of :class:`~clbrdf.rig.connection.FoundInstrument`.

Modules load quickly: what an extra brings is imported where it is used.
"""

from __future__ import annotations

import importlib
import pkgutil
from typing import Any

from clbrdf.errors import InputError
from clbrdf.rig.connection import NoConnection
from clbrdf.rig.errors import InstrumentError
from clbrdf.storage.tomlfile import TomlTable


def driver_names(role: str = "") -> tuple[str, ...]:
    """Names of the drivers for a role: "stages", "spectrometer" or "reference"; of all if it is ""."""
    names = sorted(m.name for m in pkgutil.iter_modules(__path__) if not m.name.startswith("_"))
    return tuple(name for name in names if not role or role in _module(name).ROLES)


def get_driver(role: str, name: str) -> Any:
    """Return the module of a driver.

    Raises
    ------
    InputError
        No driver for this role has the name.
    """
    known = driver_names(role)
    if name not in known:
        raise InputError(f"no driver for {role} is called {name!r}; there are {', '.join(known)}")
    return _module(name)


def connection_of(role: str, driver: Any) -> type[TomlTable]:
    """Return the settings that a driver adds to its section of the rig file in a role."""
    own: type[TomlTable] = getattr(driver, "Connection", NoConnection)
    kind: type[TomlTable] = getattr(driver, "CONNECTIONS", {}).get(role, own)
    return kind


def axis_of(driver: Any) -> type[TomlTable]:
    """Return the settings that a driver of stages adds to each axis."""
    kind: type[TomlTable] = getattr(driver, "Axis", NoConnection)
    return kind


def import_extra(module: str, extra: str) -> Any:
    """Import what an extra brings.

    Raises
    ------
    InstrumentError
        It is not installed.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise InstrumentError(
            f"{module.partition('.')[0]} is not installed; install it with: pip install 'clbrdf[{extra}]'"
        ) from error


def _module(name: str) -> Any:
    return importlib.import_module(f"{__name__}.{name}")
