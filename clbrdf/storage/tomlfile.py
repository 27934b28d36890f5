"""TOML files checked by pydantic, with every complaint in one line: file, place, value, mend."""

from __future__ import annotations

import difflib
import tomllib
from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, ValidationError

from clbrdf.errors import InputError, shortened

LONGEST_PART = 300
"""Characters of one part of a message."""


class TomlTable(BaseModel):
    """Base of what is read from TOML: immutable, unknown keys refused, no NaN or infinity."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


S = TypeVar("S", bound=TomlTable)


def load_toml(path: str | Path, kind: type[S]) -> S:
    """Read a file into its settings.

    Raises
    ------
    InputError
        Missing, not TOML, an unknown key, a missing one, or a value that cannot be.
    """
    source = Path(path)
    try:
        text = source.read_text(encoding="utf-8")
    except FileNotFoundError as error:
        raise InputError(f"{source}: no such file") from error
    except UnicodeDecodeError as error:
        raise InputError(
            f"{source}: cannot be read as text, which a TOML file is; name another file"
        ) from error
    except OSError as error:
        raise InputError(f"{source}: cannot be read ({error.strerror})") from error
    return parse_toml(text, kind, str(source))


def parse_toml(text: str, kind: type[S], name: str) -> S:
    """Read a text into its settings; `name` stands for the file in messages.

    Raises
    ------
    InputError
        As `load_toml`.
    """
    try:
        content = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # also integers of thousands of digits, and deep nesting
        raise InputError(f"{name}: not TOML: {shortened(str(error), LONGEST_PART)}") from error
    try:
        return kind.model_validate(content)
    except ValidationError as error:
        raise InputError(f"{name}: {_first_complaint(error, kind)}") from error
    except (ArithmeticError, RecursionError) as error:
        raise InputError(f"{name}: holds a number that cannot be computed with ({error})") from error


def parse_json(text: str, kind: type[S], name: str) -> S:
    """Read settings that a file of ours holds as JSON; `name` stands for the place in messages.

    Raises
    ------
    InputError
        As `load_toml`.
    """
    try:
        return kind.model_validate_json(text)
    except ValidationError as error:
        raise InputError(f"{name}: {_first_complaint(error, kind)}") from error


def _first_complaint(error: ValidationError, kind: type[BaseModel]) -> str:
    first = error.errors(include_url=False)[0]
    place = [part for part in first["loc"] if part != "function-after"]
    where = _dotted(place)
    if first["type"] == "extra_forbidden":
        known = _keys_at(kind, place[:-1])
        near = difflib.get_close_matches(str(place[-1]), known, n=1)
        hint = f"did you mean {near[0]}?" if near else f"known here: {', '.join(known)}"
        return f"unknown key {where}; {shortened(hint, LONGEST_PART)}"
    if first["type"] == "missing":
        return f"{where} is missing; add it"
    message = first["msg"].removeprefix("Value error, ")
    message = (
        shortened(message, LONGEST_PART)
        .replace("Input should be", "should be")
        .replace("Instance should be", "should be")
    )
    value = first["input"]
    if first["type"] == "value_error" or isinstance(value, dict):
        return f"{where}: {message}" if where else message
    return f"{where} = {shortened(repr(value))}: {message}"


def _dotted(place: list[Any]) -> str:
    text = ""
    for part in place:
        text += f"[{part}]" if isinstance(part, int) else f"{'.' if text else ''}{shortened(part)}"
    return shortened(text, LONGEST_PART)


def _keys_at(kind: type[BaseModel], place: list[Any]) -> list[str]:
    """Return the keys allowed at a place, walking down the models."""
    for part in place:
        if isinstance(part, int) or part not in kind.model_fields:
            continue
        annotation = kind.model_fields[part].annotation
        models = [a for a in (annotation, *_arguments(annotation)) if _is_model(a)]
        if models:
            kind = models[0]
    return list(kind.model_fields)


def _arguments(annotation: Any) -> list[Any]:
    found = list(get_args(annotation))
    return found + [inner for a in found for inner in get_args(a)]


def _is_model(annotation: Any) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)
