"""BiRD JSON: arrays of angles and values by name, each with its unit (EMPIR 18SIB03 BxDiff).

``data`` holds theta_i, phi_i, theta_r, phi_r, BRDF, and perhaps uBRDF, wavelength_i, wavelength_r,
polarization_i, polarization_r, each ``{unit, values}``. The older dialect has ``data.variables`` and rows in
``data.values``. Azimuths are counted from a mark on the sample.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.formats.bird_write import write
from clbrdf.formats.reading import SURE as ALL
from clbrdf.formats.reading import Reading, Stated
from clbrdf.formats.registry import NO, SURE, Format, Head
from clbrdf.formats.table import long_reading
from clbrdf.formats.text import read_text
from clbrdf.storage import units

Array = npt.NDArray[np.float64]

REQUIRED = ("theta_i", "phi_i", "theta_r", "phi_r", "BRDF")
POLARISATIONS = {"s": "s", "p": "p", "u": "unpolarised", "unpolarized": "unpolarised"} | {
    "unpolarised": "unpolarised", "none": "unpolarised", "": "unknown", "unknown": "unknown"
}  # fmt: skip


def sniff(head: Head) -> int:
    """Return whether it is JSON that names BRDF and theta_r."""
    text = head.text.lstrip("\ufeff \t\r\n")
    return SURE if text.startswith("{") and '"brdf"' in text and ('"theta_r"' in text) else NO


def load_json(path: Path) -> dict[str, Any]:
    """Return the object that a JSON file holds.

    Raises
    ------
    InputError
        No JSON, with the line; nested too deeply; not an object.
    """
    try:
        found = json.loads(read_text(path).lstrip("\ufeff"))
    except json.JSONDecodeError as error:
        raise InputError(
            f"{path}, line {error.lineno}: no JSON ({error.msg}); the file is cut or damaged"
        ) from None
    except (RecursionError, ValueError) as error:
        raise InputError(f"{path}: no JSON that can be read ({type(error).__name__})") from None
    if not isinstance(found, dict):
        raise InputError(f"{path}: holds a {type(found).__name__}, and an object is needed")
    return found


def read(path: Path) -> list[Reading]:
    """Read a BiRD file: one reading for each pair of polarisations.

    Raises
    ------
    InputError
        Naming the variable: missing, of another length, no numbers, an unknown unit; light of another
        wavelength than comes in (fluorescence).
    """
    content = load_json(path)
    data = content.get("data")
    if not isinstance(data, dict):
        raise InputError(f"{path}: has no object 'data'")
    variables = _old(path, data) if "variables" in data else data
    missing = [name for name in REQUIRED if name not in variables]
    if missing:
        raise InputError(f"{path}: data has no {', '.join(missing)}")
    length = len(_values(path, variables, "BRDF"))

    def column(name: str, known: Mapping[str, float]) -> Array:
        return _numbers(path, variables, name, known, length)

    angles = [column(name, units.ANGLE) for name in REQUIRED[:4]]
    brdf = column("BRDF", units.BRDF)
    sigma = _sigma(variables, brdf, column)
    waves = column("wavelength_i", units.LENGTH) if "wavelength_i" in variables else None
    if waves is not None and "wavelength_r" in variables:
        seen = column("wavelength_r", units.LENGTH)
        if not np.allclose(seen, waves, rtol=0.0, atol=0.5):
            place = int(np.argmax(np.abs(seen - waves)))
            raise InputError(
                f"{path}: row {place + 1}: {waves[place]:g} nm comes in and {seen[place]:g} nm goes out;"
                " a scan holds no fluorescence, leave such rows out"
            )
    groups = _polarisations(path, variables, length)
    keys = np.stack(angles, axis=1)
    metadata = content.get("metadata")
    notes = _notes(variables)
    ours = _text(metadata, ("software",)).startswith("clbrdf")
    stated = Stated(sure=ALL if ours else frozenset({"angle", "length", "origin"}))
    out = []
    for (source, detector), rows in groups.items():
        spectrum, columns = (np.empty(0), np.zeros(len(rows), np.intp))
        if waves is not None:
            spectrum, back = np.unique(waves[rows], return_inverse=True)
            columns = np.asarray(back.reshape(-1), dtype=np.intp)
        sample = _text(metadata, ("name", "sample", "title", "ID"))
        if len(groups) > 1:
            sample = f"{sample or path.stem} {source} in, {detector} out"
        out.append(
            long_reading(
                path, keys[rows], brdf[rows], columns, spectrum, () if waves is not None else ("monochrome",),
                stated, None if sigma is None else sigma[rows],
                sample=sample, instrument=_text(metadata, ("instrument", "provider")), notes=notes,
                extra={"source_polarisation": source, "detector_polarisation": detector},
            )
        )  # fmt: skip
    return out


def _old(path: Path, data: dict[str, Any]) -> dict[str, Any]:
    """Return the variables of the older dialect as those of the new one."""
    described, rows = data.get("variables"), data.get("values")
    if not isinstance(described, list) or not isinstance(rows, list) or not rows:
        raise InputError(f"{path}: data.variables and data.values should be lists")
    names = [item.get("name") if isinstance(item, dict) else None for item in described]
    bad = next((k for k, row in enumerate(rows) if not isinstance(row, list) or len(row) != len(names)), None)
    if bad is not None:
        raise InputError(f"{path}: data.values row {bad + 1} has not {len(names)} values, one a variable")
    return {
        str(name): {"unit": item.get("unit", ""), "values": [row[k] for row in rows]}
        for k, (name, item) in enumerate(zip(names, described, strict=True))
        if isinstance(item, dict)
    }


def _values(path: Path, variables: Mapping[str, Any], name: str) -> list[Any]:
    item = variables[name]
    values = item.get("values") if isinstance(item, dict) else None
    if not isinstance(values, list) or not values:
        raise InputError(f"{path}: data.{name} has no list 'values'")
    return values


def _numbers(
    path: Path, variables: Mapping[str, Any], name: str, known: Mapping[str, float], length: int
) -> Array:
    values = _values(path, variables, name)
    if len(values) != length:
        raise InputError(f"{path}: data.{name} has {len(values)} values, and data.BRDF {length}")
    try:
        found = np.array([np.nan if value is None else value for value in values], dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{path}: data.{name} holds something else than numbers") from None
    if found.ndim != 1:
        raise InputError(f"{path}: data.{name} holds lists, and numbers are needed")
    try:
        return found * units.factor(known, str(variables[name].get("unit", "")))
    except InputError as error:
        raise InputError(f"{path}: data.{name}: {error}") from None


def _sigma(variables: Mapping[str, Any], brdf: Array, column: Callable[..., Array]) -> Array | None:
    if "uBRDF" not in variables:
        return None
    item = variables["uBRDF"]
    percent = isinstance(item, dict) and str(item.get("unit", "")).strip() == "%"
    if not percent:
        return np.abs(column("uBRDF", units.BRDF))
    return np.abs(column("uBRDF", {"%": 0.01})) * np.abs(brdf)


def _polarisations(
    path: Path, variables: Mapping[str, Any], length: int
) -> dict[tuple[str, str], npt.NDArray[np.intp]]:
    words = []
    for name in ("polarization_i", "polarization_r"):
        if name not in variables:
            words.append(["unknown"] * length)
            continue
        values = _values(path, variables, name)
        if len(values) != length:
            raise InputError(f"{path}: data.{name} has {len(values)} values, and data.BRDF {length}")
        unknown = next((v for v in values if str(v).strip().casefold() not in POLARISATIONS), None)
        if unknown is not None:
            raise InputError(f"{path}: data.{name} is {str(unknown)[:20]!r}; known are s, p and unpolarized")
        words.append([POLARISATIONS[str(v).strip().casefold()] for v in values])
    groups: dict[tuple[str, str], list[int]] = {}
    for k, pair in enumerate(zip(*words, strict=True)):
        groups.setdefault((pair[0], pair[1]), []).append(k)
    return {pair: np.array(rows, dtype=np.intp) for pair, rows in groups.items()}


def _notes(variables: Mapping[str, Any]) -> tuple[str, ...]:
    notes = []
    if "uBRDF" in variables:
        notes.append("uBRDF is taken for a standard uncertainty; an expanded one has to be divided by its k")
    if "adhoc_variables" in variables:
        notes.append("adhoc_variables were left out")
    return tuple(notes)


def _text(metadata: Any, names: tuple[str, ...]) -> str:
    if not isinstance(metadata, dict):
        return ""
    return next((str(metadata[name]) for name in names if isinstance(metadata.get(name), str)), "")


FORMAT = Format(
    "bird", "BiRD JSON", (".bird.json", ".json"), sniff, read, write,
    "any directions and wavelengths, uncertainties and polarisation",
)  # fmt: skip
