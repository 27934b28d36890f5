"""`clbrdf evaluate`: model values as a table."""

from __future__ import annotations

import math
import sys
from typing import Annotated

import numpy as np
from cyclopts import Parameter

from clbrdf.cli.console import print_table
from clbrdf.cli.options import DeviceName, JsonFile, Overwrite, number_list, parameter_map
from clbrdf.errors import InputError
from clbrdf.evaluate import WORTH_MEASURING, evaluate, with_wavelength
from clbrdf.models import DEFAULT_MODEL, NEEDS_PHI, Model, get_model
from clbrdf.opencl.cheapest import choose_precision
from clbrdf.opencl.device import Device, choose_device
from clbrdf.storage.files import whole_text

MOST_TABLE_ROWS = 2000
"""Longer results are printed line by line in fixed columns: a table would have to be held as a whole."""

MOST_DIRECTIONS = 10_000_000
"""Of a grid, which is held as a whole."""


def command(
    *,
    theta_i: str,
    theta_r: str,
    phi: str = "180",
    phi_i: str = "0",
    param: Annotated[list[str], Parameter(consume_multiple=True, negative_iterable="")] = [],  # noqa: B006 (cyclopts needs a list)
    wavelength: float | None = None,
    model: str = DEFAULT_MODEL,
    force: Annotated[bool, Parameter(negative="")] = False,
    precision: str | None = None,
    rtol: float | None = None,
    grid: Annotated[bool, Parameter(negative="")] = False,
    device: DeviceName = None,
    json: JsonFile = None,
    overwrite: Overwrite = False,
) -> None:
    """Print the model's BRDF (1/sr) in the directions given.

    Angles are degrees: one number, a list 30,45,60, or a range 0:85:5. Lists of equal length are taken
    pair by pair, one value is repeated; --grid takes all combinations.

    Parameters
    ----------
    theta_i
        incident zenith, 0 to below 90
    theta_r
        view zenith, 0 to below 90
    phi
        azimuth of the view direction from the incident one; 180 is forward
    phi_i
        incident azimuth on the sample, for models of surfaces with a direction of their own
    param
        name=value, as often as needed; the others keep the model's defaults
    wavelength
        in nm, for models that depend on the wavelength itself
    model
        name of the model, or a sum such as ggx+minnaert; clbrdf models lists them
    force
        allow a sum of models that are whole surfaces each, such as hapke+rpv
    precision
        arithmetic of the work: fast (or fast:3 to fast:6), single, double (the default), reference
    rtol
        relative tolerance in place of a precision: the cheapest that keeps it is taken, and said
    grid
        all combinations of the angles
    """
    judged = get_model(model, force=force)
    given = (("theta-i", theta_i), ("theta-r", theta_r), ("phi", phi), ("phi-i", phi_i))
    angles = [number_list(f"--{name}", text) for name, text in given]
    lengths = {f"--{name}": len(a) for (name, _), a in zip(given, angles, strict=True) if len(a) > 1}
    if not grid and len(set(lengths.values())) > 1:
        told = " and ".join(f"{length} of {name}" for name, length in lengths.items())
        raise InputError(f"{told}; give lists of one length, single values, or --grid for all combinations")
    if grid and (count := math.prod(len(a) for a in angles)) > MOST_DIRECTIONS:
        raise InputError(
            f"--grid: {count} directions, at most {MOST_DIRECTIONS}; take wider steps, or a scene file and"
            " 'clbrdf simulate', which writes block by block"
        )
    if grid:
        angles = [a.ravel() for a in np.meshgrid(*angles, indexing="ij")]
    chosen, parameters = choose_device(device), parameter_map(param)
    precision = _precision(precision, rtol, chosen, judged, max(len(a) for a in angles))
    *directions, azimuth = angles
    values = evaluate(
        parameters,
        *directions,
        phi_i=azimuth,
        wavelength=wavelength,
        model=judged,
        precision=precision,
        device=chosen,
    )
    names, headings = ["theta_i", "theta_r", "phi"], ["θi (°)", "θr (°)", "φ (°)"]
    columns = directions
    if judged.flags & NEEDS_PHI:
        columns, names, headings = [*columns, azimuth], [*names, "phi_i"], [*headings, "φi (°)"]
    names, headings = [*names, "brdf"], [*headings, "BRDF (1/sr)"]
    table = np.broadcast_arrays(*columns, values)
    if json is not None:
        vector = judged.vector(with_wavelength(judged, parameters, wavelength))
        content = {
            "model": judged.name,
            "parameters": dict(zip(judged.names, vector.tolist(), strict=True)),
            "precision": precision,
            "device": str(chosen),
            **{name: column.tolist() for name, column in zip(names, table, strict=True)},
        }
        whole_text(json, content, overwrite)
    rows = ([*(f"{angle:.10g}" for angle in at), f"{f:.7g}"] for *at, f in zip(*table, strict=True))
    if len(values) <= MOST_TABLE_ROWS:
        print_table("", headings, rows, left=0)
    else:
        print("".join(f"{name:>14}" for name in headings))
        sys.stdout.writelines("".join(f"{word:>14}" for word in row) + "\n" for row in rows)


def _precision(precision: str | None, rtol: float | None, device: Device, model: Model, values: int) -> str:
    """Return the precision asked for, or the one that a tolerance asks for, which is said."""
    if rtol is None:
        return precision or "double"
    if precision is not None:
        raise InputError("--precision and --rtol both choose the arithmetic; give one of them")
    choice = choose_precision(rtol, device=device, model=model, measure=values >= WORTH_MEASURING)
    print(f"rtol {rtol:g}: {choice}", file=sys.stderr)
    return choice.precision.name
