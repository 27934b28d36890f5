"""`clbrdf export` to tables and grids: from a scan as it is, from a fit in directions of the format's own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clbrdf.cli.console import print_table
from clbrdf.cli.summary import spectrum
from clbrdf.colour import rgb_weights
from clbrdf.errors import InputError
from clbrdf.fit.result import Fit
from clbrdf.formats.grow import FIRST, LARGEST_VIEW, LAST, Grown, grow
from clbrdf.formats.merl import node_directions
from clbrdf.formats.registry import Format
from clbrdf.geometry import Directions
from clbrdf.scan import Scan
from clbrdf.scan.flags import FLAGS, for_other_reasons
from clbrdf.scan.select import has_near
from clbrdf.storage import hdf5
from clbrdf.storage.files import check_output, whole_file

GROWN = ("ssdd", "zemax")
"""Formats of a grid about the specular direction."""


@dataclass(frozen=True, eq=False)
class Chosen:
    """What of a file is exported.

    Attributes
    ----------
    wavelength : (K,) float64 or None
        nm; None for all.
    side : "reflection", "transmission" or None
    phi_i : float or None
        Incident azimuth, degrees.
    """

    wavelength: npt.NDArray[np.float64] | None = None
    side: str | None = None
    phi_i: float | None = None


def export_table(
    file: Path,
    output: Path,
    kind: Format,
    tolerance: float,
    chosen: Chosen,
    overwrite: bool,
    illuminant: str | None = None,
) -> None:
    """Write a scan or fit in a format of tables or grids, and print what was written and what was not.

    With an `illuminant` the wavelengths become R, G and B of linear sRGB under it.

    Raises
    ------
    InputError
        The format cannot hold what is asked; files that cannot be read or written.
    """
    assert kind.write is not None
    target = check_output(output, overwrite)
    with hdf5.open_file(file) as opened:
        content = hdf5.content_of(opened)
    rows: list[Sequence[str]] = []
    if content == "fit":
        scan, grown = from_fit(Fit.open(file), kind.name, tolerance, chosen)
        if grown is not None:
            rows += _reached(grown, tolerance)
        else:
            rows.append(["values", "of the fitted model"])
    else:
        scan = part_of(Scan.open(file), chosen)
        rows.append(["values", "as measured"])
    if illuminant is not None:
        scan = in_rgb(scan, illuminant)
    with whole_file(target, overwrite) as part:
        try:
            kind.write(scan, part)
        except InputError as error:
            raise InputError(f"{target}: {error}") from error
        size = part.stat().st_size
    rows = [
        ["format", kind.title],
        ["directions", f"{len(scan)}"],
        ["bands" if scan.bands else "wavelengths", ", ".join(scan.labels) if len(scan.labels) < 8 else
         f"{len(scan.labels)}, {scan.labels[0]} to {scan.labels[-1]}"],
        *rows,
        ["size", f"{size / 1e6:.3g} MB" if size > 1e5 else f"{size / 1e3:.3g} kB"],
    ]  # fmt: skip
    left_out = not_kept(scan, kind.name)
    if left_out:
        rows.append(["not kept", ", ".join(left_out)])
    print_table("", (target.name, ""), rows, left=2)


def in_rgb(scan: Scan, illuminant: str) -> Scan:
    """Return a scan in R, G and B of linear sRGB; what lies outside of it becomes 0.

    Raises
    ------
    InputError
        The scan has bands, or wavelengths that determine no colour; an unknown illuminant.
    """
    if scan.bands:
        raise InputError(f"the scan has the bands {', '.join(scan.bands)} already; leave --rgb out")
    weights = rgb_weights(scan.wavelength, illuminant, "write a format that holds wavelengths")
    assert scan.flags is not None
    masked = np.asarray(for_other_reasons(scan.flags).any(axis=1), dtype=np.bool_)
    values = np.maximum(np.where(masked.reshape(-1, 1), np.nan, scan.brdf @ weights.T), 0.0)
    missing = np.repeat(masked.reshape(-1, 1), 3, axis=1).astype(np.uint32)  # bit 0: not measured
    return replace(
        scan, wavelength=np.full(3, np.nan), bands=("R", "G", "B"), brdf=values, sigma=None, flags=missing,
        flag_names=FLAGS, bandpass=None,
    )  # fmt: skip


def part_of(scan: Scan, chosen: Chosen) -> Scan:
    """Return the part of a scan that is exported.

    Raises
    ------
    InputError
        There is no such part.
    """
    if chosen.wavelength is not None:
        for wavelength in chosen.wavelength:
            if not has_near(scan, wavelength):
                raise InputError(
                    f"--wavelength {wavelength:g}: the scan has none near it; it has {spectrum(scan)}"
                )
        scan = scan.at(chosen.wavelength)
    if chosen.side is not None:
        rows = scan.transmitted == (chosen.side == "transmission")
        if not rows.any():
            raise InputError(f"--side {chosen.side}: the scan has no such direction")
        scan = scan.rows(rows)
    if chosen.phi_i is not None:
        rows = np.abs(scan.phi_i - chosen.phi_i % 360.0) < 0.05
        if not rows.any():
            there = ", ".join(f"{angle:g}" for angle in np.unique(scan.phi_i)[:12])
            raise InputError(
                f"--phi-i {chosen.phi_i:g}: the scan has no such incident azimuth; it has {there}"
            )
        scan = scan.rows(rows)
    return scan


def from_fit(fit: Fit, name: str, tolerance: float, chosen: Chosen) -> tuple[Scan, Grown | None]:
    """Return a fit's model as a scan: in the fitted directions, or on a grid of the format's own."""
    scan = part_of(fit.scan, replace(chosen, side=None, phi_i=None))
    places = [k for k, label in enumerate(fit.scan.labels) if label in scan.labels]
    if not np.isfinite(fit.vector[places]).all():
        raise InputError("the fit has no parameters at some wavelengths; choose others with --wavelength")

    def values(directions: Directions) -> npt.NDArray[np.float64]:
        return fit.evaluate(directions)[:, places]

    grown = grow(values, tolerance) if name in GROWN else None
    if grown is not None:
        directions, found = grown.directions, grown.values
    else:
        directions = node_directions() if name == "merl" else fit.scan.directions
        found = values(directions)
    made = Scan(
        directions.theta_i, directions.phi_i, directions.theta_r, directions.phi_r,
        scan.wavelength, found, sample=scan.sample, instrument=f"model {fit.model.name}, fitted",
        bands=scan.bands,
    )  # fmt: skip
    return made, grown


def not_kept(scan: Scan, name: str) -> list[str]:
    """Return what a scan has and a format does not hold."""
    out = []
    if scan.sigma is not None and name not in ("columns", "bird"):
        out.append("uncertainties")
    assert scan.flags is not None
    masked = int(for_other_reasons(scan.flags).sum())
    if masked and name != "columns":
        out.append(f"why {masked} values are masked")
    if {scan.source_polarisation, scan.detector_polarisation} != {"unknown"} and name != "bird":
        out.append("polarisation")
    for attribute, word in (("solid_angle", "solid angle of the receiver"), ("bandpass", "bandpass")):
        if getattr(scan, attribute) is not None and name != "columns":
            out.append(word)
    if name == "merl":
        out.append("directions finer than a cell")
    return out


def _reached(grown: Grown, tolerance: float) -> list[Sequence[str]]:
    """Say what a grown grid is and what it reached."""
    short = "" if grown.reached <= tolerance else ", as fine as it gets"
    return [
        ["grid", " × ".join(str(n) for n in grown.shape) + " (θi, azimuth, radial angle)"],
        ["reached", f"{100 * grown.reached:.2g} % of {100 * tolerance:.2g} %, {grown.rounds} rounds{short}"],
        ["checked", f"θi {FIRST:g} to {LAST:g}°, θr up to {LARGEST_VIEW:g}°, half near the mirror direction"],
    ]
