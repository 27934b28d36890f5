"""`clbrdf export` to a tensor file of RGL's form, which Mitsuba renders."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clbrdf.cli.console import print_table, progress_bar
from clbrdf.cli.export_table import Chosen
from clbrdf.colour import DEFAULT_ILLUMINANT
from clbrdf.errors import InputError
from clbrdf.formats.rgl.accuracy import FIRST_INCIDENT, LARGEST_VIEW, LAST_INCIDENT
from clbrdf.formats.rgl.export import Export, export_material
from clbrdf.formats.rgl.tables import write_tables
from clbrdf.render.sources import MaterialSource, in_colour, in_false_colour, material_at, open_source
from clbrdf.storage.files import check_output


@dataclass(frozen=True, eq=False)
class Colour:
    """How wavelengths become three bands.

    Attributes
    ----------
    rgb : bool
        As an eye sees them.
    illuminant : str or None
        Under this light; None for the default.
    false_colour : (K,) float64 or None
        As three wavelengths, nm, for red, green and blue.
    """

    rgb: bool = False
    illuminant: str | None = None
    false_colour: npt.NDArray[np.float64] | None = None

    @property
    def asked(self) -> str:
        """The first option that was given; "" for none."""
        given = {
            "--rgb": self.rgb,
            "--illuminant": self.illuminant is not None,
            "--false-colour": self.false_colour is not None,
        }
        return next((name for name, is_given in given.items() if is_given), "")


def export_rgl(
    file: Path, output: Path, tolerance: float, chosen: Chosen, colour: Colour, overwrite: bool = False
) -> None:
    """Write the material of a fit or scan file as a tensor file, and print what was reached.

    Raises
    ------
    InputError
        Options that do not go together, a scan that cannot be interpolated, a tolerance that cannot be kept.
    """
    target = check_output(output, overwrite)
    if colour.rgb and colour.false_colour is not None:
        raise InputError("--rgb and --false-colour both choose the three bands; give one of them")
    if colour.illuminant is not None and not colour.rgb:
        raise InputError("--illuminant says what light --rgb is for; give --rgb, too")
    if chosen.side == "transmission":
        raise InputError("--side transmission: an rgl file holds reflection only")
    source = open_source(file, chosen.phi_i)
    if chosen.wavelength is not None:
        source = material_at(source, chosen.wavelength)
    if colour.rgb:
        source = in_colour(source, colour.illuminant or DEFAULT_ILLUMINANT)
    elif colour.false_colour is not None:
        source = in_false_colour(source, colour.false_colour)
    made = run_export(source, tolerance)
    write_tables(target, made.tables, overwrite)
    print_export(target, made)


def run_export(source: MaterialSource, tolerance: float, label: str = "growing the grid") -> Export:
    """Export a material with a progress bar; its remarks go to standard error."""
    for remark in source.remarks:
        print(f"{source.name}: {remark}", file=sys.stderr)
    with progress_bar(label) as report:
        return export_material(source.material, tolerance, report)


def print_export(target: Path, made: Export) -> None:
    """Print a table of what was written and how accurate it is."""
    accuracy, tables = made.accuracy, made.tables
    worst_at, worst = accuracy.worst_incident
    rows = [
        ["incident angles × samples", f"{made.incidents} × {made.side} × {made.side}"],
        ["wavelengths", "R, G, B" if accuracy.rgb else _range(tables.wavelength)],
        ["size", f"{target.stat().st_size / 1e6:.2f} MB"],
        ["time", f"{made.seconds:.1f} s, {made.rounds} grid{'s' if made.rounds > 1 else ''} tried"],
        ["tolerance", percent(made.tolerance)],
        [
            "reached" + ("" if accuracy.rgb or len(accuracy.by_band) == 1 else ", worst wavelength"),
            percent(accuracy.reached),
        ],
        ["of the light over the hemisphere", percent(accuracy.light)],
        ["worst incident angle", f"{percent(worst)} at {worst_at:.1f}°"],
        [
            "beyond, " + ", ".join(f"{angle:g}°" for angle in made.beyond.theta_i),
            ", ".join(percent(value) for value in made.beyond.by_incident),
        ],
    ]
    print_table("", (target.name, ""), rows, left=2)
    print(
        f"Errors are Σ|error|/Σ|f| over {accuracy.directions} directions, half of them about the mirror"
        f" direction:\nθi {FIRST_INCIDENT:g}–{LAST_INCIDENT:g}°, θr up to {LARGEST_VIEW:g}°."
    )


def percent(value: float) -> str:
    """Return a share as a percentage of two or three digits."""
    return f"{100.0 * value:.3g} %"


def _range(wavelength: npt.NDArray[np.float32] | None) -> str:
    assert wavelength is not None
    if len(wavelength) == 1:
        return f"{wavelength[0]:g} nm"
    return f"{len(wavelength)}, {wavelength[0]:g}–{wavelength[-1]:g} nm"
