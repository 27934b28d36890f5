"""Speos `.brdf` and `.anisotropicbsdf` text, version 8.0: tables of relative values, scaled by percent.

Values are relative; what a direction scatters in all, in percent, sets their scale. The azimuth is counted
from the forward half-plane: 0 is forward. Source: Ansys Speos help, "Structure of the BRDF and of the
anisotropic BSDF surface file".
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.formats.reading import SURE as ALL
from clbrdf.formats.reading import Reading, Stated
from clbrdf.formats.registry import NO, SURE, Format, Head
from clbrdf.formats.rings import ring_weights, turn_weights
from clbrdf.formats.text import count_of, increasing, numbers, read_text, shown, take

Array = npt.NDArray[np.float64]

ISOTROPIC, ANISOTROPIC = "brdf surface file v8.0", "anisotropic bsdf surface file v8.0"
MOST = 100_000


def sniff(head: Head) -> int:
    """Return whether the first line names a Speos file of version 8.0."""
    first = head.lines[0] if head.lines else ""
    return SURE if first.startswith("optis") and first.endswith((ISOTROPIC, ANISOTROPIC)) else NO


@dataclass(frozen=True, eq=False)
class Table:
    """One table: zeniths (T,), azimuths (P,), degrees, and values (T, P)."""

    zenith: Array
    azimuth: Array
    values: Array

    @property
    def transmission(self) -> bool:
        """Whether the zeniths lie beyond the surface."""
        return bool(self.zenith[-1] > 90.0)

    def total(self, cosine: bool) -> float:
        """∫ v cosθ dΩ, or ∫ v dΩ."""
        zenith = np.abs(self.zenith - (180.0 if self.transmission else 0.0))
        order = np.argsort(zenith)
        rings = ring_weights(zenith[order], cosine) if len(zenith) > 1 else np.zeros(1)
        return float(2.0 * np.pi * rings @ self.values[order] @ turn_weights(self.azimuth))


def read(path: Path) -> list[Reading]:
    """Read a Speos file.

    Raises
    ------
    InputError
        Naming the line: another version, a binary body, counts that the file cannot hold, tables of
        another size, a scale that nothing sets.
    """
    lines = _Raw(path, read_text(path))
    kind = lines.next("the header").casefold()
    if (form := lines.next("0 for text")) != "0":
        raise InputError(f"{path}, line 2: {shown(form)}; only text files (0) are read, save it as text")
    lines.next("a comment")
    count = count_of(path, lines.next("a length"), "characters", 1 << 20, f"line {lines.number}")
    lines.skip_characters(count)
    return [_isotropic(lines)] if kind.endswith(f"- {ISOTROPIC}") else [_anisotropic(lines)]


class _Raw:
    """Lines as they stand, blank ones included: a description may hold anything."""

    def __init__(self, path: Path, text: str) -> None:
        self.path, self._lines, self.number = path, text.split("\n"), 0

    def next(self, what: str) -> str:
        if self.number >= len(self._lines):
            raise InputError(f"{self.path}: ends where {what} should stand; the file is cut")
        self.number += 1
        return self._lines[self.number - 1].strip()

    def skip_characters(self, count: int) -> None:
        while count > 0:
            self.next("the description")
            count -= len(self._lines[self.number - 1]) + 1

    def some(self, what: str) -> Array:
        """Return the next line that is not blank as numbers."""
        while not (line := self.next(what)):
            pass
        return numbers(self.path, line, self.number)

    def exactly(self, what: str, count: int) -> Array:
        return np.asarray(take(self.path, self.some(what), count, what, f"line {self.number}"))

    def counts(self, what: str, count: int) -> list[int]:
        values = self.exactly(what, count)
        words = [f"{value:g}" for value in values]
        return [count_of(self.path, word, what, MOST, f"line {self.number}") for word in words]

    def table(self) -> Table:
        n_theta, n_phi = self.counts("zeniths and azimuths", 2)
        if n_theta * n_phi > sum(map(len, self._lines[self.number :])):
            raise InputError(
                f"{self.path}, line {self.number}: {n_theta} × {n_phi} values, more than the file has"
            )
        azimuth = increasing(self.path, self.exactly("azimuths", n_phi), "azimuth")
        rows = np.array([self.exactly("a zenith and its values", n_phi + 1) for _ in range(n_theta)])
        zenith = increasing(self.path, rows[:, 0], "zenith")
        if zenith[0] < 0.0 or zenith[-1] > 180.0 or zenith[0] < 90.0 < zenith[-1]:
            raise InputError(f"{self.path}, line {self.number}: zeniths lie in 0° to 90° or in 90° to 180°")
        return Table(zenith, azimuth, rows[:, 1:])


def _isotropic(lines: _Raw) -> Reading:
    flags = lines.exactly("flags of reflection and transmission", 2)
    cosine = not lines.exactly("1 for BSDF or 0 for intensity", 1)[0]
    n_inc, n_wl = lines.counts("incidences and wavelengths", 2)
    incidence = increasing(lines.path, lines.exactly("incidences", n_inc), "incidence")
    spectrum = increasing(lines.path, lines.exactly("wavelengths", n_wl), "wavelength")
    sides: dict[bool, list[tuple[float, Table]]] = {False: [], True: []}
    for _ in range(n_inc * n_wl * int((flags != 0.0).sum())):
        percent = float(lines.exactly("the percent", 1)[0])
        table = lines.table()
        sides[table.transmission].append((percent, table))
    parts = []
    for tables in sides.values():
        if not tables:
            continue
        take(lines.path, tables, n_inc * n_wl, "tables of one side")
        for k, theta_i in enumerate(incidence):
            here = tables[k * n_wl : (k + 1) * n_wl]
            scaled = [_scaled(lines, table, percent, cosine) for percent, table in here]
            parts.append(_rows(lines, [table for _, table in here], scaled, float(theta_i), 0.0))
    return _joined(parts, spectrum, ())


def _anisotropic(lines: _Raw) -> Reading:
    lines.exactly("the direction of anisotropy", 3)
    flags = lines.exactly("flags of reflection and transmission", 2)
    cosine = not lines.exactly("1 for BSDF or 0 for intensity", 1)[0]
    (n_rot,) = lines.counts("rotations", 1)
    rotations = lines.exactly("rotations", n_rot)
    incidences = [lines.exactly("incidences", *lines.counts("incidences", 1)) for _ in range(n_rot)]
    parts = []
    spectra = []
    for _ in range(int((flags != 0.0).sum())):
        reference = lines.exactly("incidence and rotation of the spectrum", 2)
        lines.next("the name of the spectrum")
        spectra.append(
            [lines.exactly("wavelength and percent", 2) for _ in range(*lines.counts("wavelengths", 1))]
        )
        tables = {
            (float(rotation), float(theta_i)): lines.table()
            for rotation, several in zip(rotations, incidences, strict=True)
            for theta_i in several
        }
        at = tables.get((float(reference[1]), float(reference[0])))
        percent = float(np.mean([value for _, value in spectra[-1]]))
        if at is None or (total := at.total(cosine=not cosine)) <= 0.0:
            raise InputError(
                f"{lines.path}: nothing sets the scale: no table at incidence {reference[0]:g}°,"
                f" rotation {reference[1]:g}°, of which the spectrum is"
            )
        for (rotation, theta_i), table in tables.items():
            values = _without_cosine(table, cosine) * (percent / 100.0 / total)
            parts.append(_rows(lines, [table], [values], theta_i, rotation))
    first = np.array(spectra[0])
    flat = np.ptp(first[:, 1]) <= 1e-9 * np.abs(first[:, 1]).max()
    reading = _joined(parts, np.empty(0), ("monochrome",))
    if flat or len(spectra) > 1:
        return reading
    # One shape for all wavelengths, scaled by the spectrum.
    values = reading.values * (first[:, 1] / first[:, 1].mean())
    return Reading(
        reading.theta_i, reading.phi_i, reading.theta_r, reading.phi_r, values,
        increasing(lines.path, first[:, 0], "wavelength"), (), reading.stated, notes=reading.notes,
    )  # fmt: skip


def _without_cosine(table: Table, cosine: bool) -> Array:
    if not cosine:
        return table.values
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(table.values / np.abs(np.cos(np.deg2rad(table.zenith)))[:, None])


def _scaled(lines: _Raw, table: Table, percent: float, cosine: bool) -> Array:
    total = table.total(cosine=not cosine)
    if total <= 0.0:
        if percent > 0.0:
            raise InputError(f"{lines.path}: a table of zeros cannot scatter {percent:g} %")
        return np.zeros_like(table.values)
    return _without_cosine(table, cosine) * (percent / 100.0 / total)


def _rows(
    lines: _Raw, tables: list[Table], values: list[Array], theta_i: float, rotation: float
) -> list[Array]:
    """Return θi, φi, θr, φ and values (N, W) of one incidence, without the horizon and the second 0°."""
    first = tables[0]
    for table in tables[1:]:
        if not (np.array_equal(table.zenith, first.zenith) and np.array_equal(table.azimuth, first.azimuth)):
            raise InputError(f"{lines.path}: at {theta_i:g}° the wavelengths have different directions")
    if not 0.0 <= theta_i < 90.0:
        raise InputError(f"{lines.path}: incidence {theta_i:g}°; it lies in 0° to 90°")
    cube = np.stack(values, axis=-1)
    keep = np.ones(cube.shape[:2], dtype=bool)
    if first.azimuth[-1] - first.azimuth[0] == 360.0:
        keep[:, -1] = (cube[:, -1] != cube[:, 0]).any(axis=-1)
    pole = np.isin(first.zenith, (0.0, 180.0))
    keep[pole, 1:] &= (cube[pole, 1:] != cube[pole, :1]).any(axis=-1)
    keep[first.zenith == 90.0] = False
    zenith, azimuth = (a[keep] for a in np.meshgrid(first.zenith, first.azimuth, indexing="ij"))
    n = len(zenith)
    return [np.full(n, theta_i), np.full(n, rotation), zenith, azimuth + rotation, cube[keep]]


def _joined(parts: list[list[Array]], spectrum: Array, bands: tuple[str, ...]) -> Reading:
    theta_i, phi_i, theta_r, phi_r, values = (np.concatenate([part[k] for part in parts]) for k in range(5))
    notes = ("values are relative; the percent of each direction sets their scale",)
    return Reading(
        theta_i, phi_i, theta_r, phi_r, values, spectrum, bands, Stated(forward=0.0, sure=ALL), notes=notes
    )


FORMAT = Format("speos", "Speos .brdf and .anisotropicbsdf text 8.0", (".brdf",), sniff, read)
