"""RGL/EPFL tensor `.bsdf`, RGB and spectral, isotropic and anisotropic: scans in and out."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from clbrdf.errors import InputError
from clbrdf.formats.reading import Reading
from clbrdf.formats.registry import NO, SURE, Format, Head
from clbrdf.formats.rgl.export import export_material
from clbrdf.formats.rgl.interpolate import interpolated
from clbrdf.formats.rgl.material import Material
from clbrdf.formats.rgl.nodes import stored_nodes
from clbrdf.formats.rgl.tables import BANDS, ONE_BAND, read_tables, write_tables
from clbrdf.formats.rgl.tensor_file import is_tensor_file
from clbrdf.scan import Scan


def sniff(head: Head) -> int:
    """Return whether the file begins as a tensor file does."""
    return SURE if is_tensor_file(head.start) else NO


def read(path: Path) -> list[Reading]:
    """Read the stored samples of an RGL file; nothing is interpolated.

    Raises
    ------
    InputError
        As `read_tables`.
    """
    tables = read_tables(path)
    nodes = stored_nodes(tables)
    total = tables.spectra.size // tables.bands
    notes = [
        f"{total - len(nodes.brdf)} of {total} samples lie below the horizon or at grazing incidence, or"
        " stand twice, and were left out"
    ]
    if tables.isotropic:
        notes.append("isotropic: incident azimuths are 0")
    return [
        Reading(
            nodes.theta_i,
            nodes.phi_i,
            nodes.theta_r,
            nodes.phi_r,
            nodes.brdf,
            spectrum=np.empty(0) if tables.wavelength is None else tables.wavelength.astype(np.float64),
            bands=BANDS if tables.wavelength is None else (),
            sample=tables.description,
            notes=tuple(notes),
        )
    ]


def scan_material(scan: Scan) -> tuple[Material, tuple[str, ...]]:
    """Return a measured BRDF, interpolated, as a material, and remarks.

    Raises
    ------
    InputError
        It cannot be interpolated, or has bands that make no colour.
    """
    reflected = scan.reflection()
    if scan.bands and tuple(name.upper() for name in scan.bands) != BANDS:
        raise InputError(f"the bands {', '.join(scan.bands)} make no colour; R, G and B do; {ONE_BAND}")
    brdf, remarks = interpolated(reflected)
    name = scan.sample or "a sample"
    wavelength = None if scan.bands else scan.wavelength
    return Material(brdf, wavelength, f"{name}: measured, interpolated by clbrdf"), remarks


def write(scan: Scan, path: Path) -> None:
    """Write a scan, interpolated, as an RGL file within the default tolerance of the interpolation.

    Raises
    ------
    InputError
        It cannot be interpolated, or the file cannot be written.
    """
    write_tables(path, export_material(scan_material(scan)[0]).tables, overwrite=True)


FORMAT = Format(
    "rgl",
    "RGL/EPFL tensor .bsdf, RGB or spectral, as Mitsuba renders",
    (".bsdf",),
    sniff,
    read,
    write,
    "isotropic reflection over the hemisphere, interpolated; wavelengths or R, G, B",
)
