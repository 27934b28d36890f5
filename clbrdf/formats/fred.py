"""FRED scatter text: ``type bsdf_data``, ``format angles=deg bsdf=value scale=1``, then groups.

A group begins with a line of two numbers, the specular direction θ and φ; rows θ φ value follow. Source:
Photon Engineering, FRED help, "Tabulated scatter". Forward is the azimuth of the specular direction.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from clbrdf.errors import InputError
from clbrdf.formats.reading import Reading, Stated
from clbrdf.formats.registry import NO, SURE, Format, Head
from clbrdf.formats.text import Lines, numbers, read_text, shown

SETTINGS = {"angles": ("deg", "sin"), "bsdf": ("value", "log")}


def sniff(head: Head) -> int:
    """Return whether the first line says bsdf_data."""
    return SURE if head.lines and re.fullmatch(r"type\s+bsdf_data", head.lines[0]) else NO


def read(path: Path) -> list[Reading]:
    """Read a FRED file.

    Raises
    ------
    InputError
        Naming the line: an unknown setting, a line of neither two nor three numbers, rows before a group.
    """
    lines = Lines(path, read_text(path), comment="!")
    if not re.fullmatch(r"type\s+bsdf_data", first := lines.take("type bsdf_data"), re.IGNORECASE):
        raise InputError(f"{path}, line {lines.number}: {shown(first)}, where 'type bsdf_data' should stand")
    settings = {"angles": "deg", "bsdf": "value", "scale": "1"}
    if lines.peek().casefold().startswith("format"):
        for word in lines.take("format").split()[1:]:
            name, _, value = word.casefold().partition("=")
            if name not in settings or value not in SETTINGS.get(name, (value,)):
                raise InputError(f"{path}, line {lines.number}: {shown(word)} is no setting of a FRED file")
            settings[name] = value
    try:
        scale = float(settings["scale"])
    except ValueError:
        raise InputError(f"{path}: scale={settings['scale']} is no number") from None
    places, rows = lines.rest()
    lengths = np.array([len(row.replace(",", " ").split()) for row in rows])
    if len(rows) == 0 or lengths[0] != 2:
        raise InputError(f"{path}: the specular direction, two numbers, should stand before its rows")
    if not np.isin(lengths, (2, 3)).all():
        bad = int(np.argmax(~np.isin(lengths, (2, 3))))
        raise InputError(
            f"{path}, line {places[bad]}: {lengths[bad]} numbers; rows have 3, a group begins with 2"
        )
    begins = lengths == 2
    flat = numbers(path, "\n".join(rows), places[0])
    ends = np.cumsum(lengths)
    specular = np.stack([flat[ends[begins] - 2], flat[ends[begins] - 1]], axis=1)
    theta, phi, value = (flat[ends[~begins] - k] for k in (3, 2, 1))
    if len(theta) == 0:
        raise InputError(f"{path}: no row of values")
    theta_i, phi_s = specular[(np.cumsum(begins) - 1)[~begins]].T
    if settings["angles"] == "sin":
        if np.abs(np.concatenate([theta, theta_i])).max() > 1.0:
            raise InputError(f"{path}: a sine beyond 1; the angles are no sines, as angles=sin says")
        theta, theta_i = np.rad2deg(np.arcsin(theta)), np.rad2deg(np.arcsin(theta_i))
    if settings["bsdf"] == "log":
        with np.errstate(over="ignore"):
            value = 10.0**value
    behind = theta < 0.0  # in-plane data: a negative zenith lies across the normal
    return [
        Reading(
            np.abs(theta_i),
            np.where(theta_i < 0.0, phi_s, phi_s + 180.0),
            np.abs(theta),
            np.where(behind, phi + 180.0, phi),
            (value * scale)[:, None],
            bands=("monochrome",),
            stated=Stated(sure=frozenset({"origin", "forward"})),
        )
    ]


FORMAT = Format("fred", "FRED tabulated scatter, one wavelength", (".fred",), sniff, read)
