"""LBNL WINDOW XML: matrices over Klems patches, or tensor trees, of reflection and transmission.

``WavelengthData`` blocks name a spectrum ("Visible", "Solar", or a wavelength), a direction of
``WavelengthDataDirection`` and hold ``ScatteringData``, 1/sr without cosine; "BTDF" is written for
reflection, too. Sources: LBNL, Window BSDF schema 1.x; Klems 1994, ASHRAE Transactions 100(1).
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.formats.klems import Basis, bases, matrix_reading
from clbrdf.formats.reading import Reading
from clbrdf.formats.registry import NO, SURE, Format, Head
from clbrdf.formats.tensor_tree import tree_reading
from clbrdf.formats.text import read_text
from clbrdf.scan import Scan
from clbrdf.storage import units

Array = npt.NDArray[np.float64]

DECLARATION = re.compile(r"^\s*<\?xml[^>]*\?>")
SIDES = ("front", "back")
KINDS = ("transmission", "reflection")


def sniff(head: Head) -> int:
    """Return whether it is the XML of a WindowElement."""
    return SURE if "<windowelement" in head.text else NO


def read(path: Path) -> list[Reading]:
    """Read a WINDOW file: one reading for light from the front and one from the back.

    Bands that have the same directions stand side by side.

    Raises
    ------
    InputError
        No XML, an unknown structure or direction, a matrix of another size than its basis.
    """
    text = read_text(path)
    if "<!ENTITY" in text:
        raise InputError(f"{path}: defines entities, which no WINDOW file needs; refused")
    try:
        # The text is decoded already, whatever encoding its first line names.
        root = ET.fromstring(DECLARATION.sub("", text, count=1))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: no XML that can be read ({type(error).__name__})") from None
    except ET.ParseError as error:
        line = error.position[0]
        raise InputError(
            f"{path}, line {line}: no XML ({error.msg.split(':')[0]}); the file is damaged"
        ) from None
    for item in root.iter():
        item.tag = item.tag.rpartition("}")[2]
    layers = root.findall(".//Layer") or [root]
    out = [reading for layer in layers for reading in _layer(path, layer)]
    if not out:
        raise InputError(f"{path}: no WavelengthData with ScatteringData in it")
    return out


def _layer(path: Path, layer: ET.Element) -> list[Reading]:
    structure = _word(layer, ".//IncidentDataStructure").casefold()
    name = _word(layer, ".//Material/Name") or _word(layer, ".//Name")
    known = bases(path, layer) if not structure.startswith("tensortree") else {}
    parts: dict[tuple[str, str], Reading] = {}
    for data in layer.findall(".//WavelengthData"):
        band = data.find("Wavelength")
        column = _column(band)
        for block in data.findall("WavelengthDataBlock"):
            kind, side = _direction(path, block)
            content = block.findtext("ScatteringData")
            if not content or not content.strip():
                continue
            one = _block(path, structure, block, content, known, kind == "transmission")
            one = replace(one, **column)
            key = (kind, side)
            parts[key] = one if key not in parts else _beside(path, parts[key], one)
    out = []
    for side in SIDES:
        both = [parts[kind, side] for kind in KINDS if (kind, side) in parts]
        if (
            len(both) == 2
            and both[0].bands == both[1].bands
            and np.array_equal(both[0].spectrum, both[1].spectrum)
        ):
            both = [_below(both[1], both[0])]
        out += [replace(reading, sample=f"{name.strip()} {side}".strip()) for reading in both]
    return out


def _block(
    path: Path, structure: str, block: ET.Element, content: str, known: dict[str, Basis], transmission: bool
) -> Reading:
    if structure.startswith("tensortree"):
        return tree_reading(path, content, 3 if structure.endswith("3") else 4, transmission)
    if structure not in ("columns", "rows"):
        raise InputError(
            f"{path}: IncidentDataStructure {structure!r}; known are Columns, Rows, TensorTree3 and 4"
        )
    names = [_word(block, "ColumnAngleBasis"), _word(block, "RowAngleBasis")]
    chosen = [known.get(name.casefold()) for name in names]
    incident, outgoing = (chosen[0], chosen[1]) if structure == "columns" else (chosen[1], chosen[0])
    if incident is None or outgoing is None:
        missing = names[chosen.index(None)]
        raise InputError(
            f"{path}: no AngleBasis is called {missing!r}; there are {', '.join(known) or 'none'}"
        )
    return matrix_reading(path, content, incident, outgoing, transmission, structure == "rows")


def _direction(path: Path, block: ET.Element) -> tuple[str, str]:
    words = _word(block, "WavelengthDataDirection").casefold().split()
    if len(words) != 2 or words[0] not in KINDS or words[1] not in SIDES:
        said = " ".join(words)
        raise InputError(
            f"{path}: WavelengthDataDirection {said!r}; known are Transmission and Reflection, Front and Back"
        )
    return words[0], words[1]


def _column(band: ET.Element | None) -> dict[str, Any]:
    """Return the spectrum of one column: a wavelength where a length is given, else a band."""
    text = (band.text or "").strip() if band is not None else ""
    unit = band.get("unit", "") if band is not None else ""
    try:
        nm = float(text) * units.factor(units.LENGTH, unit)
    except (ValueError, InputError):
        return {"bands": (text or "unnamed",), "spectrum": np.empty(0)}
    return {"bands": (), "spectrum": np.array([nm])}


def _beside(path: Path, one: Reading, two: Reading) -> Reading:
    """Join the columns of two readings with the same directions."""
    names = ("theta_i", "phi_i", "theta_r", "phi_r")
    if not all(np.array_equal(getattr(one, n), getattr(two, n)) for n in names):
        return _union(path, one, two)
    if set(one.bands) & set(two.bands) or set(one.spectrum) & set(two.spectrum):
        raise InputError(f"{path}: two blocks of {', '.join(two.bands) or two.spectrum[0]} for one direction")
    values = np.concatenate([one.values, two.values], axis=1)
    if bool(one.bands) != bool(two.bands):
        raise InputError(f"{path}: some WavelengthData name a wavelength and some a band; split the file")
    order = np.argsort(np.concatenate([one.spectrum, two.spectrum])) if not one.bands else slice(None)
    spectrum = np.concatenate([one.spectrum, two.spectrum])
    return replace(
        one,
        values=np.ascontiguousarray(values[:, order]),
        bands=one.bands + two.bands,
        spectrum=spectrum if one.bands else spectrum[order],
    )


def _union(path: Path, one: Reading, two: Reading) -> Reading:
    """Join two readings of different directions, as trees of different bands are; see `Scan.merge`."""

    def scan(reading: Reading) -> Scan:
        waves = reading.spectrum if not reading.bands else np.full(len(reading.bands), np.nan)
        angles = reading.theta_i, reading.phi_i, reading.theta_r, reading.phi_r
        return Scan(*angles, waves, reading.values, bands=reading.bands)

    try:
        both = Scan.merge([scan(one), scan(two)])
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    return replace(
        one, theta_i=both.theta_i, phi_i=both.phi_i, theta_r=both.theta_r, phi_r=both.phi_r, values=both.brdf,
        flags=both.flags, bands=both.bands, spectrum=np.empty(0) if both.bands else both.wavelength,
    )  # fmt: skip


def _below(one: Reading, two: Reading) -> Reading:
    """Join the rows of two readings with the same columns."""
    names = ("theta_i", "phi_i", "theta_r", "phi_r", "values")
    joined: dict[str, Any] = {n: np.concatenate([getattr(one, n), getattr(two, n)]) for n in names}
    extra = {}
    if "solid_angle" in one.extra and "solid_angle" in two.extra:
        extra = {"solid_angle": np.concatenate([one.extra["solid_angle"], two.extra["solid_angle"]])}
    flags = None
    if one.flags is not None or two.flags is not None:
        flags = np.concatenate([_flags(one), _flags(two)])
    return replace(one, **joined, extra=extra, flags=flags)


def _flags(reading: Reading) -> npt.NDArray[np.uint32]:
    return np.zeros(reading.values.shape, np.uint32) if reading.flags is None else reading.flags


def _word(item: ET.Element, where: str) -> str:
    return (item.findtext(where) or "").strip()


FORMAT = Format("window", "LBNL WINDOW XML, Klems and tensor tree", (".xml",), sniff, read)
