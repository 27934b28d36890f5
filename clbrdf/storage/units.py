"""Units as files write them, and what one of each is in degrees, nanometres, 1/sr and sr."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

from clbrdf.errors import InputError

_DEGREE = 180.0 / math.pi

ANGLE: Mapping[str, float] = MappingProxyType(
    {"deg": 1.0, "degree": 1.0, "degrees": 1.0, "°": 1.0}
    | {"rad": _DEGREE, "radian": _DEGREE, "radians": _DEGREE, "mrad": _DEGREE / 1000.0}
)
LENGTH: Mapping[str, float] = MappingProxyType(
    {"nm": 1.0, "nanometer": 1.0, "nanometre": 1.0, "angstrom": 0.1, "å": 0.1}
    | {"um": 1e3, "µm": 1e3, "μm": 1e3, "micron": 1e3, "micrometer": 1e3, "micrometre": 1e3}
    | {"mm": 1e6, "m": 1e9}
)
BRDF: Mapping[str, float] = MappingProxyType(
    {"1/sr": 1.0, "sr^-1": 1.0, "sr-1": 1.0, "sr⁻¹": 1.0, "per_sr": 1.0, "1_sr": 1.0}
)
SOLID_ANGLE: Mapping[str, float] = MappingProxyType({"sr": 1.0, "msr": 1e-3, "usr": 1e-6, "µsr": 1e-6})

COUNTLESS: Mapping[str, float] = MappingProxyType({"1": 1.0, "": 1.0})
"""Of pure numbers."""

SHORTEST, LONGEST = 10.0, 1e6
"""nm; beyond, the unit of a wavelength is wrong."""


def factor(known: Mapping[str, float], written: str) -> float:
    """Return by what a value in a written unit is multiplied.

    Raises
    ------
    InputError
        A unit that is not known; the message names those that are.
    """
    found = known.get("".join(written.split()).casefold())
    if found is None:
        said = f"unit {written.strip()!r} is not known" if written.strip() else "the unit is missing"
        raise InputError(f"{said}; known are {spellings(known)}")
    return found


def same_as(unit: str) -> Mapping[str, float]:
    """Return the units that can stand where `unit` is meant, and what one of each is in it."""
    plain = "".join(unit.split()).casefold()
    for known in (COUNTLESS, ANGLE, LENGTH, BRDF, SOLID_ANGLE):
        if plain in known:
            return {name: value / known[plain] for name, value in known.items()}
    return {plain: 1.0}


def spellings(known: Mapping[str, float]) -> str:
    """Return the units, one spelling each."""
    first: dict[float, str] = {}
    for name, value in known.items():
        first.setdefault(value, name)
    return ", ".join(first.values())
