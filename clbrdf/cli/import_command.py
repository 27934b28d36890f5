"""`clbrdf import`: measured files into a scan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from clbrdf.cli.options import Output, Overwrite, column_map
from clbrdf.cli.summary import print_scan, print_scans
from clbrdf.errors import InputError
from clbrdf.formats.guard import Options
from clbrdf.formats.load import load
from clbrdf.formats.stated import scale_map, share_of, with_stated
from clbrdf.scan import save_scans
from clbrdf.storage.files import check_apart, check_output
from clbrdf.storage.provenance import made_by

Unit = Literal["deg", "rad", "nm", "um"]
Scale = Literal["1", "pi", "percent", "pi-percent"]


def command(
    files: list[Path],
    /,
    *,
    output: Output,
    format_: Annotated[str | None, Parameter(name="--format")] = None,
    sample: str | None = None,
    unit: Annotated[list[Unit] | None, Parameter(negative="")] = None,
    phi_forward: Literal[0, 180] | None = None,
    cosine: Literal["included", "none"] | None = None,
    scale: Scale | None = None,
    origin: Literal["normal", "specular"] | None = None,
    swap: Literal["none", "polar", "zeniths"] | None = None,
    wavelength: float | None = None,
    map_: Annotated[list[str], Parameter(name="--map", negative_iterable="")] = [],  # noqa: B006 (cyclopts)
    scale_uncertainty: Annotated[list[str], Parameter(negative_iterable="")] = [],  # noqa: B006
    random_uncertainty: str | None = None,
    overwrite: Overwrite = False,
) -> None:
    """Read measured BRDF from files of any known format into one scan file.

    Columns of a CSV file, in any order and case, units in the names: wavelength_nm, theta_i_deg, theta_r_deg,
    dphi_deg (180 is forward), fr_per_sr; optional fr_std_per_sr, fr_std_common_per_sr (of an error that all
    values share), sample, flag.

    The format is found by content ('clbrdf formats' lists them). Several files, one a wavelength or one an
    incident angle, are joined into one scan; several samples in a file become scans by name, as in
    file.h5::name. Conventions are held against the data: where the data contradict what a file says, or two
    readings fit, one of the options below is asked for. What was taken is told and kept in the file.

    Parameters
    ----------
    files
        files that together hold the scan
    format_
        the format, where the content does not tell it
    sample
        take only this sample
    unit
        of angles (deg, rad) or wavelengths (nm, um); may be given twice
    phi_forward
        azimuth difference of the forward half-plane in the file
    cosine
        whether values are multiplied by the cosine of the view zenith
    scale
        what values are: f, pi f, 100 f or 100 pi f
    origin
        where view zeniths are counted from
    swap
        exchange zenith and azimuth (polar) or incident and view direction (zeniths)
    wavelength
        nm, for a file of one band that names none
    map_
        column=name where a table calls a column otherwise, such as "Angle in=theta_i_deg"; as often as needed
    scale_uncertainty
        standard uncertainty of an error that all values have in common, such as 2% of the reference panel;
        with names as in panel=2%, as often as needed
    random_uncertainty
        standard uncertainty of each value for itself, such as 0.5%
    """
    check_apart([output], files)
    target = check_output(output, overwrite)
    options = Options(
        angle=_one_of(unit, ("deg", "rad")),
        length=_one_of(unit, ("nm", "um")),
        origin=origin,
        forward=None if phi_forward is None else float(phi_forward),
        cosine=None if cosine is None else cosine == "included",
        scale=scale,
        swap=swap,
        wavelength=wavelength,
    )
    scales = scale_map(scale_uncertainty)
    random = None if random_uncertainty is None else share_of(random_uncertainty, "--random-uncertainty")
    loaded = load(files, format_name=format_, sample=sample, options=options, names=column_map(map_))
    given = {
        "format": format_, "sample": sample, "unit": list(unit or ()), "phi-forward": phi_forward,
        "cosine": cosine, "scale": scale, "origin": origin, "swap": swap, "wavelength": wavelength,
        "map": list(map_), "scale-uncertainty": scale_uncertainty or None,
        "random-uncertainty": random_uncertainty,
    }  # fmt: skip
    scans = {
        name: replace(
            with_stated(scan, scales, random), provenance=made_by("import", files, given, scan.provenance)
        )
        for name, scan in loaded.scans.items()
    }
    if len(scans) == 1:
        scans = {"entry": next(iter(scans.values()))}
    save_scans(target, scans, overwrite)
    if len(scans) > 1:
        print_scans(str(target), scans)
        print(f"one of them is named as in {target.name}::{next(iter(scans))}")
        return
    print_scan(str(target), next(iter(scans.values())))


def _one_of(units: Sequence[str] | None, known: tuple[str, str]) -> str | None:
    """Return the unit of one kind that was given, None where none was."""
    found = [unit for unit in units or () if unit in known]
    if len(set(found)) > 1:
        raise InputError(f"--unit {known[0]} and --unit {known[1]} exclude each other; give one of them")
    return found[0] if found else None
