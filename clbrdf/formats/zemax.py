"""Zemax `.bsdf` text, one wavelength or X, Y, Z, in angles about the specular direction.

Keywords, then for each rotation of the sample and each angle of incidence a line ``TIS x`` and a row of
values over the radial angle for each azimuth. Source: Ansys Zemax, "BSDF data interchange file format
specification". Values are 1/sr without cosine; those below the horizon pad the rows.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.formats.reading import SURE as ALL
from clbrdf.formats.reading import Reading, Stated
from clbrdf.formats.registry import NO, SURE, Format, Head
from clbrdf.formats.text import Lines, count_of, increasing, read_text, shown
from clbrdf.formats.vectors import from_specular
from clbrdf.formats.zemax_write import write

Array = npt.NDArray[np.float64]

SYMMETRIES = ("planesymmetrical", "asymmetrical", "asymmetrical4d")
CONTENTS = {"monochrome": ("Monochrome",), "xyz": ("TristimulusX", "TristimulusY", "TristimulusZ")}
LISTS = ("samplerotation", "angleofincidence", "scatterazimuth", "scatterradial")
MOST = 100_000
WAVELENGTH = re.compile(r"(\d+(?:\.\d+)?)\s*nm\b", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class Header:
    """Keywords of a file, and its four lists of angles, degrees."""

    words: Mapping[str, str]
    lists: Mapping[str, Array]
    names: tuple[str, ...]

    @property
    def transmission(self) -> bool:
        """Whether the file holds a BTDF."""
        return self.words["scattertype"] == "btdf"


def sniff(head: Head) -> int:
    """Return whether the keywords of a Zemax file stand at the beginning."""
    return SURE if all(word in head.text for word in ("samplerotation", "angleofincidence")) else NO


def read(path: Path) -> list[Reading]:
    """Read a Zemax file.

    Raises
    ------
    InputError
        Naming the line: a keyword missing or unknown, a count that the file cannot hold, a word that is no
        number, an end before the data's.
    """
    text = read_text(path)
    comments = [line.lstrip("# \t") for line in text.split("\n") if line.lstrip().startswith("#")]
    lines = Lines(path, text)
    header = _header(path, lines, len(text))
    blocks, tis = zip(*(_block(path, lines, header, name) for name in header.names), strict=True)
    return [_reading(header, np.stack(blocks, axis=-1), tis[0], comments)]


def _header(path: Path, lines: Lines, size: int) -> Header:
    words: dict[str, str] = {}
    lists: dict[str, Array] = {}
    while len(lists) < len(LISTS) or "spectralcontent" not in words:
        key, _, rest = (
            lines.take("a keyword").partition(" ") if " " in lines.peek() else (lines.take(""), "", "")
        )
        key, tabbed, after = key.partition("\t")
        name, value = key.casefold(), (after + rest if tabbed else rest).strip()
        place = f"line {lines.number}"
        if name in LISTS:
            count = count_of(path, value.split()[0] if value.split() else "", "angles", MOST, place)
            lists[name] = lines.some_numbers("angles", count)
        elif name in ("source", "symmetry", "spectralcontent", "scattertype"):
            words[name] = value.casefold()
        else:
            raise InputError(f"{path}, {place}: {shown(key)} is no keyword of a Zemax file")
    content = words["spectralcontent"]
    if content not in CONTENTS:
        raise InputError(f"{path}: SpectralContent {content!r}; known are Monochrome and XYZ")
    if words.get("symmetry", "") not in SYMMETRIES:
        raise InputError(f"{path}: Symmetry {words.get('symmetry', '')!r}; known are {', '.join(SYMMETRIES)}")
    if words.setdefault("scattertype", "brdf") not in ("brdf", "btdf"):
        raise InputError(f"{path}: ScatterType {words['scattertype']!r}; known are BRDF and BTDF")
    for name in LISTS:
        lists[name] = increasing(path, lists[name], name)
    if lists["scatterradial"].min() < 0.0 or lists["scatterradial"].max() > 180.0:
        raise InputError(f"{path}: ScatterRadial beyond 0° to 180°")
    incidence = lists["angleofincidence"]
    if incidence.min() < 0.0 or incidence.max() >= 90.0:
        raise InputError(f"{path}: AngleOfIncidence beyond 0° to 90°")
    total = len(CONTENTS[content]) * int(np.prod([len(lists[name]) for name in LISTS], dtype=object))
    if 2 * total > size:
        raise InputError(f"{path}: the lists of angles ask for {total} values, more than the file can hold")
    return Header(words, lists, CONTENTS[content])


def _block(path: Path, lines: Lines, header: Header, name: str) -> tuple[Array, dict[float, float]]:
    """Read one component: values (rotation, incidence, azimuth, radial), and TIS by incidence."""
    rotations, incidences, azimuths, radials = (header.lists[each] for each in LISTS)
    found = lines.take(name)
    if found.casefold() != name.casefold():
        raise InputError(f"{path}, line {lines.number}: {shown(found)}, where {name} should stand")
    if (begin := lines.take("DataBegin")).casefold() != "databegin":
        raise InputError(f"{path}, line {lines.number}: {shown(begin)}, where DataBegin should stand")
    values = np.empty([len(header.lists[each]) for each in LISTS])
    tis: dict[float, float] = {}
    for r in range(len(rotations)):
        for i, incidence in enumerate(incidences):
            words = lines.take("TIS").split()
            try:
                tis[float(incidence)] = float(words[1]) if words[0].casefold() == "tis" else float("nan")
            except (IndexError, ValueError):
                tis[float(incidence)] = float("nan")
            if np.isnan(tis[float(incidence)]):
                raise InputError(f"{path}, line {lines.number}: a TIS and its value should stand here")
            count = len(azimuths) * len(radials)
            values[r, i] = lines.some_numbers("values", count).reshape(len(azimuths), len(radials))
    if (end := lines.take("DataEnd")).casefold() != "dataend":
        raise InputError(f"{path}, line {lines.number}: {shown(end)}, where DataEnd should stand")
    return values, tis


def _reading(header: Header, values: Array, tis: dict[float, float], comments: list[str]) -> Reading:
    rotations, incidences, azimuths, radials = (header.lists[each] for each in LISTS)
    # A whole turn repeats its first azimuth, and so does the centre for every azimuth.
    unique = np.ones(values.shape[:4], dtype=bool)
    if len(azimuths) > 1 and azimuths[-1] - azimuths[0] == 360.0:
        unique[:, :, -1] = (values[:, :, -1] != values[:, :, 0]).any(axis=-1)
    for j in np.flatnonzero(radials == 0.0):
        unique[:, :, 1:, j] &= (values[:, :, 1:, j] != values[:, :, :1, j]).any(axis=-1)
    rotation, theta_i, azimuth, radial = (
        a[unique] for a in np.meshgrid(rotations, incidences, azimuths, radials, indexing="ij")
    )
    theta_r, phi = from_specular(theta_i, azimuth, radial)
    if header.transmission:
        theta_r = 180.0 - theta_r
    # 89.9999… is the horizon, too: cosθr of 1e-9 is rounding.
    beyond = (theta_r <= 90.0 + 1e-6) if header.transmission else (theta_r >= 90.0 - 1e-6)
    flat, keep = values[unique], ~beyond
    lost = int(np.count_nonzero(flat[beyond]))
    notes = [f"{int(beyond.sum())} directions beyond the horizon were left out ({lost} values other than 0)"]
    if len(rotations) > 1:
        notes.append("a rotation of the sample by ρ is taken as φi = ρ")
    nm = sorted({float(found) for line in comments for found in WAVELENGTH.findall(line)})
    bands: tuple[str, ...] = ("X", "Y", "Z")
    spectrum = np.empty(0)
    if header.words["spectralcontent"] == "monochrome":
        bands = ("monochrome",)
        if len(nm) == 1 and 10.0 < nm[0] < 1e6:
            bands, spectrum = (), np.array(nm)
            notes.append(f"a comment names {nm[0]:g} nm, which is taken for the wavelength")
    sample = next((line[7:].strip() for line in comments if line.casefold().startswith("sample:")), "")
    return Reading(
        theta_i[keep],
        rotation[keep],
        theta_r[keep],
        (rotation + phi)[keep],
        flat[keep],
        spectrum,
        bands,
        Stated(sure=ALL),
        sample=sample,
        instrument=next((c[14:].strip() for c in comments if c.casefold().startswith("scatterometer:")), ""),
        notes=tuple(notes),
        tis=tis if header.names == ("Monochrome",) else {},
    )


FORMAT = Format(
    "zemax", "Zemax .bsdf text, one wavelength or XYZ", (".bsdf",), sniff, read, write,
    "one side and one wavelength, on a grid about the specular direction",
)  # fmt: skip
