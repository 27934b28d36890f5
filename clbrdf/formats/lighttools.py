"""LightTools BSDF text: a header as in Zemax files, then a block for each incidence, side and wavelength.

``AOI POI Side Wavelength ScatterType [TristimulusValue] TIS`` and a row of values over the radial angle for
each azimuth, in angles about the surface normal; of an isotropic file the incident azimuth is 90°. Source:
the reader of libbsdf (K. Ryo).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.formats.reading import Reading, Stated
from clbrdf.formats.registry import NO, SURE, Format, Head
from clbrdf.formats.table import LongTable
from clbrdf.formats.text import count_of, increasing, read_text, shown

Array = npt.NDArray[np.float64]

MOST = 100_000
INCIDENT_AZIMUTH = 90.0
SIDES, TYPES = ("front", "back"), ("brdf", "btdf")
COMPONENTS = {"trisx": "X", "trisy": "Y", "trisz": "Z"}


def sniff(head: Head) -> int:
    """Return whether the keywords of a LightTools file stand in it."""
    words = ("scatterazimuth", "scatterradial", "databegin", "aoi")
    return SURE if all(w in head.text for w in words) and "angleofincidence" not in head.text else NO


@dataclass
class _Block:
    aoi: float = 0.0
    poi: float = 0.0
    side: str = "front"
    wavelength: float = 0.0
    kind: str = "brdf"
    component: str = ""
    values: Array = field(default_factory=lambda: np.empty(0))


class _Words:
    """The words of a text in turn, comments left out, with the lines they stand in."""

    def __init__(self, path: Path, text: str) -> None:
        self.path = path
        self._words = [
            (word, number)
            for number, line in enumerate(text.split("\n"), 1)
            for word in line.partition("#")[0].split()
        ]
        self._next, self.line = 0, 1

    def left(self) -> bool:
        return self._next < len(self._words)

    def take(self, what: str) -> str:
        if not self.left():
            raise InputError(f"{self.path}: ends where {what} should stand; the file is cut")
        word, self.line = self._words[self._next]
        self._next += 1
        return word

    def number(self, what: str) -> float:
        word = self.take(what)
        try:
            return float(word)
        except ValueError:
            raise InputError(f"{self.path}, line {self.line}: {shown(word)} is no number ({what})") from None

    def one_of(self, what: str, known: tuple[str, ...]) -> str:
        word = self.take(what)
        if word.casefold() not in known:
            raise InputError(
                f"{self.path}, line {self.line}: {what} {shown(word)}; known are {', '.join(known)}"
            )
        return word.casefold()

    def list(self, what: str) -> Array:
        word = self.take(f"the number of {what}")
        count = count_of(self.path, word, what, MOST, f"line {self.line}")
        return increasing(self.path, np.array([self.number(what) for _ in range(count)]), what)


def read(path: Path) -> list[Reading]:
    """Read a LightTools file: one reading for the front, one for the back.

    Raises
    ------
    InputError
        Naming the line: an unknown keyword or value, a word that is no number, an end before the data's.
    """
    words = _Words(path, read_text(path))
    lists: dict[str, Array] = {}
    while (key := words.take("DataBegin").casefold()) != "databegin":
        if key in ("scatterazimuth", "scatterradial"):
            lists[key] = words.list("angles")
        elif key in ("source", "symmetry", "spectralcontent"):
            words.take(key)
    if len(lists) < 2:
        raise InputError(f"{path}: ScatterAzimuth and ScatterRadial should stand before DataBegin")
    azimuth, radial = lists["scatterazimuth"], lists["scatterradial"]
    if radial[0] < 0.0 or radial[-1] > 90.0:
        raise InputError(f"{path}: ScatterRadial beyond 0° to 90°; zeniths are counted from the normal")
    blocks = _blocks(words, len(azimuth) * len(radial))
    if not blocks:
        raise InputError(f"{path}: no block of values after DataBegin")
    return [
        _reading(path, [b for b in blocks if b.side == side], azimuth, radial, side)
        for side in SIDES
        if any(b.side == side for b in blocks)
    ]


def _blocks(words: _Words, size: int) -> list[_Block]:
    blocks: list[_Block] = []
    block = _Block()
    while words.left() and (key := words.take("a keyword").casefold()) != "dataend":
        if key in ("aoi", "poi", "wavelength"):
            setattr(block, key, words.number(key))
        elif key == "side":
            block.side = words.one_of("Side", SIDES)
        elif key == "scattertype":
            block.kind = words.one_of("ScatterType", TYPES)
        elif key == "tristimulusvalue":
            block.component = COMPONENTS[words.one_of("TristimulusValue", tuple(COMPONENTS))]
        elif key == "tis":
            words.number("TIS")
            block.values = np.array([words.number("a value") for _ in range(size)])
            blocks.append(block)
            block = _Block()
        else:
            raise InputError(
                f"{words.path}, line {words.line}: {shown(key)} is no keyword of a LightTools file"
            )
    return blocks


def _reading(path: Path, blocks: list[_Block], azimuth: Array, radial: Array, side: str) -> Reading:
    phi, zenith = (a.ravel() for a in np.meshgrid(azimuth, radial, indexing="ij"))
    below = zenith < 90.0
    table = LongTable()
    for block in blocks:
        theta_i = block.aoi if block.aoi <= 90.0 else 180.0 - block.aoi
        if not 0.0 <= theta_i < 90.0:
            raise InputError(f"{path}: AOI {block.aoi:g}°; it lies in 0° to 90°")
        theta_r = zenith if block.kind == "brdf" else 180.0 - zenith
        name = block.component or (block.wavelength if block.wavelength > 0.0 else "monochrome")
        table.add(
            theta_i, INCIDENT_AZIMUTH + block.poi, theta_r[below], phi[below], name, block.values[below]
        )
    return table.reading(
        path,
        stated=Stated(sure=frozenset({"angle", "length", "origin", "cosine", "scale"})),
        sample="" if side == "front" else "back",
        notes=("the incident azimuth is taken as 90°, as LightTools writes it",),
    )


FORMAT = Format("lighttools", "LightTools BSDF text, wavelengths or XYZ", (".ltbsdf",), sniff, read)
