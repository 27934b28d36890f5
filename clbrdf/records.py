"""Immutable records: they pickle and copy by their fields, and print in one short line."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from html import escape
from types import MappingProxyType
from typing import Any

import numpy as np


class Record:
    """Base of a frozen dataclass whose arrays and mappings nobody can write.

    A copy is made by the constructor, so that it is as checked and as immutable as what it was made from.
    """

    def __post_init__(self) -> None:
        for row in fields(self):  # type: ignore[arg-type]
            value = getattr(self, row.name)
            if isinstance(value, np.ndarray):
                value.flags.writeable = False
            elif isinstance(value, Mapping):
                object.__setattr__(self, row.name, frozen_map(value))

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        values = {row.name: getattr(self, row.name) for row in fields(self)}  # type: ignore[arg-type]
        return _made, (type(self), _unfrozen(values))


def _unfrozen(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return a mapping as a plain one, which pickles; read-only mappings within it, too."""
    return {name: _unfrozen(v) if isinstance(v, MappingProxyType) else v for name, v in values.items()}


def _made(kind: type[Any], values: dict[str, Any]) -> Any:
    return kind(**values)


def span_words(values: np.ndarray[Any, Any], unit: str) -> str:
    """Return the range of some numbers, or the only one, with its unit."""
    low, high = np.min(values), np.max(values)
    space = "" if unit == "°" else " "
    return f"{low:g}{space}{unit}" if low == high else f"{low:g} to {high:g}{space}{unit}"


def html_table(title: str, rows: Mapping[str, str]) -> str:
    """Return names and texts as a table for a notebook."""
    cells = "".join(
        f"<tr><th style='text-align:left'>{escape(name)}</th>"
        f"<td style='text-align:left'>{escape(text)}</td></tr>"
        for name, text in rows.items()
    )
    return f"<table><caption>{escape(title)}</caption>{cells}</table>"


def frozen_map(values: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return a read-only copy of a mapping; arrays in it become read-only, too."""
    for value in values.values():
        if isinstance(value, np.ndarray):
            value.flags.writeable = False
    return MappingProxyType(dict(values))
