"""Parameters that are not fitted: fixed by the user, or the wavelength itself."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError, advice
from clbrdf.models import Model
from clbrdf.models.model import numbers_of
from clbrdf.scan import Scan


def given_parameters(
    scan: Scan, model: Model, fix: Mapping[str, npt.ArrayLike]
) -> dict[str, npt.NDArray[np.float64]]:
    """Return the parameters (W,) that are not fitted, in the order of the table.

    Raises
    ------
    InputError
        A parameter that the model does not have, a value out of its domain or of another length, one that has
        to be fixed and is not, or nothing left to fit.
    """
    fix = model.by_full_name(fix)
    w, out = len(scan.wavelength), {}
    missing = [row for row in model.parameters if row.given == "user" and row.name not in fix]
    if missing:
        told = " and ".join(f"{row.name} ({row.meaning})" for row in missing)
        first = missing[0].name
        raise InputError(
            f"model {model.name} needs {told}; fix each: "
            + advice(f"fix={{{first!r}: ...}}", f"--fix {first}=VALUE or --fix {first}=FILE.csv")
        )
    for row in model.parameters:
        if row.given == "wavelength" and row.name not in fix:
            out[row.name] = np.array(scan.wavelength)
            continue
        if row.name not in fix:
            continue
        values = numbers_of(f"fixed {row.name}", fix[row.name])
        if values.shape not in ((), (1,), (w,)):
            raise InputError(
                f"fixed {row.name} has shape {values.shape}; give one value, or one for each of"
                f" {w} wavelengths"
            )
        if not np.isfinite(values).all():
            raise InputError(f"fixed {row.name} is not finite")
        takes_zero = row.log_floor != 0.0
        signed = row.sign * values
        if row.scale == "log" and not (signed >= 0.0 if takes_zero else signed > 0.0).all():
            sides = ("at least", "at most") if takes_zero else ("above", "below")
            wrong = values[signed < 0.0] if (signed < 0.0).any() else values
            side = sides[0] if row.sign > 0.0 else sides[1]
            raise InputError(f"fixed {row.name} is {wrong.flat[0]:g}; it has to be {side} 0")
        out[row.name] = np.broadcast_to(values.ravel() if values.ndim else values, w).copy()
    if len(out) == len(model.parameters):
        raise InputError(f"nothing to fit: all parameters of model {model.name} are fixed")
    return out
