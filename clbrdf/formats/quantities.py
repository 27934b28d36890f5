"""What the columns of tables are called, and in which units they may be."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from clbrdf.errors import InputError, advice, shortened
from clbrdf.storage import units


@dataclass(frozen=True)
class Quantity:
    """A column that may occur.

    Attributes
    ----------
    names : tuple of str
        Without unit; the first is the one that messages name.
    units : mapping of str to float, or None
        None for text.
    """

    names: tuple[str, ...]
    units: Mapping[str, float] | None


VALUE_UNITS = {"per_sr": 1.0, "1_sr": 1.0, "sr-1": 1.0, "sr^-1": 1.0, "1/sr": 1.0}

INCIDENT_ZENITH = (
    *("theta_i", "theta_in", "thetai", "incident_angle", "incidence_angle", "angle_of_incidence", "aoi"),
    *("incidence", "incident_zenith", "source_zenith", "src_z", "sza", "illumination_zenith"),
)
VIEW_ZENITH = (
    *("theta_r", "theta_s", "theta_v", "theta_o", "theta_out", "thetar", "measure_angle"),
    *("measurement_angle", "emission", "emission_angle", "view_zenith", "view_z", "vza", "viewing_zenith"),
    "scatter_angle",
)
AZIMUTH = ("dphi", "phi", "delta_phi", "relative_azimuth", "raa", "azimuth")
INCIDENT_AZIMUTH = ("phi_i", "phi_in", "src_a", "source_azimuth", "incident_azimuth", "saa")
VIEW_AZIMUTH = (
    *("phi_r", "phi_s", "phi_v", "phi_o", "phi_out", "view_a", "view_azimuth", "vaa", "viewing_azimuth"),
)

ANGLES = {
    "theta_i": Quantity(INCIDENT_ZENITH, units.ANGLE),
    "theta_r": Quantity(VIEW_ZENITH, units.ANGLE),
    "phi": Quantity(AZIMUTH, units.ANGLE),
    "phi_i": Quantity(INCIDENT_AZIMUTH, units.ANGLE),
    "phi_r": Quantity(VIEW_AZIMUTH, units.ANGLE),
}

LONG = {
    **ANGLES,
    "wavelength": Quantity(("wavelength", "lambda", "bandpass_central"), units.LENGTH),
    "bandpass": Quantity(("bandpass_fwhm", "bandpass", "fwhm"), units.LENGTH),
    "brdf": Quantity(("fr", "brdf", "btdf", "bsdf"), VALUE_UNITS),
    "factor": Quantity(("reflectance_factor", "brf", "brrf"), {"1": 1.0}),
    "dsf": Quantity(("dsf", "ccbrdf", "ccbsdf"), VALUE_UNITS),
    "sigma": Quantity(("fr_std", "brdf_std", "fr_errors", "brdf_errors"), VALUE_UNITS),
    "common": Quantity(("fr_std_common", "brdf_std_common"), VALUE_UNITS),
    "solid_angle": Quantity(("solid_angle",), units.SOLID_ANGLE),
    "sample": Quantity(("sample",), None),
    "band": Quantity(("band",), None),
    "flag": Quantity(("flag", "flags"), None),
}

VALUES = ("brdf", "factor", "dsf")


@dataclass(frozen=True)
class Column:
    """A column found.

    Attributes
    ----------
    place : int
    written : str
        Its heading.
    factor : float or None
        What one of its unit is in degrees, nm, 1/sr or sr; None where the heading has no unit.
    """

    place: int
    written: str
    factor: float | None


def plain_heading(heading: str) -> str:
    """Return a heading in lower case, words joined by _, brackets about a unit left out."""
    text = heading.strip().strip('"').casefold()
    return re.sub(r"[\s_]+", "_", re.sub(r"[\[\]()]", " ", text).strip())


def renamed(path: Path, headings: Sequence[str], names: Mapping[str, str]) -> list[str]:
    """Return headings with those that a user maps replaced by names that are known.

    Raises
    ------
    InputError
        A heading that is not there or stands twice, or a name that is not known.
    """
    out = [heading.strip() for heading in headings]
    for column, name in names.items():
        given = advice(f"names={{{column!r}: {name!r}}}", f"--map {column}={name}")
        places = [k for k, heading in enumerate(headings) if heading.strip().strip('"') == column]
        places = places or [
            k for k, heading in enumerate(headings) if plain_heading(heading) == plain_heading(column)
        ]
        if len(places) != 1:
            said = "is not there" if not places else f"stands {len(places)} times"
            raise InputError(
                f"{path}: {given}: column {column!r} {said}; the columns are {shortened(', '.join(out), 400)}"
            )
        text = plain_heading(name)
        stems = [stem for quantity in LONG.values() for stem in quantity.names]
        if not any(text == stem or text.startswith(f"{stem}_") for stem in stems):
            known = ", ".join(quantity.names[0] for quantity in LONG.values())
            raise InputError(
                f"{path}: {given}: {name!r} is no name of a column; there are {known}, with a"
                " unit at the end as in theta_i_deg"
            )
        out[places[0]] = name
    return out


def find_columns(path: Path, headings: Sequence[str], known: Mapping[str, Quantity]) -> dict[str, Column]:
    """Return the columns of known quantities.

    A heading that begins with a known name and goes on with something else than a unit is no such column,
    unless no other is.

    Raises
    ------
    InputError
        Two columns for one quantity, or an unknown unit.
    """
    stems = sorted(
        ((name, key) for key, q in known.items() for name in q.names), key=lambda pair: -len(pair[0])
    )
    found: dict[str, Column] = {}
    doubtful: dict[str, tuple[str, str]] = {}
    for place, heading in enumerate(headings):
        text = plain_heading(heading)
        match = next(((s, k) for s, k in stems if text == s or text.startswith(f"{s}_")), None)
        if match is None:
            continue
        stem, key = match
        unit, allowed = text[len(stem) + 1 :], known[key].units
        if (allowed is None and unit) or (allowed is not None and unit and unit not in allowed):
            doubtful[key] = (heading.strip(), unit)
            continue
        if key in found:
            raise InputError(
                f"{path}: columns {found[key].written!r} and {heading.strip()!r} both give {key}; keep one"
            )
        factor = None if allowed is None or not unit else allowed[unit]
        found[key] = Column(place, heading.strip(), factor)
    for key, (heading, unit) in doubtful.items():
        if key not in found and known[key].units is not None:
            names = units.spellings(known[key].units or {})
            raise InputError(
                f"{path}: column {shortened(repr(heading))} has the unit {shortened(repr(unit))}; known are"
                f" {names}"
            )
    return found
