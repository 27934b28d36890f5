"""Model values on the device."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from clbrdf.device import Device, choose_device
from clbrdf.errors import InputError
from clbrdf.geometry import Directions, check_reflection
from clbrdf.models import DEFAULT_MODEL, Model, get_model
from clbrdf.precision import get_precision
from clbrdf.tolerance import choose_precision
from clbrdf.values import evaluate_directions

Array = npt.NDArray[np.float64]

WORTH_MEASURING = 1_000_000
"""Values from which it pays to measure what each precision costs."""

REFERENCE = "reference"
REFERENCE_DIGITS = 60
"""Working digits of the reference: 1 − cosγ may lose 20 of them, and 40 are left."""


def evaluate(
    parameters: Mapping[str, npt.ArrayLike],
    theta_i: npt.ArrayLike,
    theta_r: npt.ArrayLike,
    phi: npt.ArrayLike,
    *,
    model: str = DEFAULT_MODEL,
    precision: str | None = None,
    rtol: float | None = None,
    device: Device | None = None,
) -> Array:
    """Evaluate a model in N directions for one parameter set or for W of them.

    Parameters
    ----------
    parameters : mapping of str to float or (W,) array
        By name, in the units of the model's table; missing ones take the table's default.
    theta_i, theta_r, phi : float or (N,) array
        Degrees; zeniths in [0, 90), φ = φr − φi with 180 forward. Lengths broadcast.
    model : str
        Name of the model.
    precision : str
        Arithmetic of the work: "fast" (or "fast:3" to "fast:5", the degree of its exp2), "single",
        "double", each with the bound stated in clbrdf.precision; or "reference", the published equations
        in 60 digits, rounded to float64, slow and without a device (needs mpmath). By default "double".
    rtol : float, optional
        In place of a precision: the cheapest that keeps this relative tolerance, as `choose_precision`
        tells. For a million values or more the costs are measured where they are not known yet.
    device : Device, optional
        From `choose_device`; the preferred one if not given.

    Returns
    -------
    (N,) or (N, W) float64
        BRDF in 1/sr, without the cosine. Values that leave the range of single precision are computed in
        double, so that none is infinite because of the arithmetic chosen.

    Raises
    ------
    InputError
        Unknown model, parameter or precision, angles out of range, lengths that do not agree, both a
        precision and a tolerance, a tolerance that cannot be kept.
    DeviceError
        No usable OpenCL device.
    """
    if rtol is not None and precision is not None:
        raise InputError("precision and rtol both choose the arithmetic; give one of them")
    chosen = get_model(model)
    vector = chosen.vector(parameters)
    directions = Directions.relative(theta_i, theta_r, phi)
    rows = np.atleast_2d(vector)
    if precision == REFERENCE:
        values = evaluate_reference(chosen, rows, directions)
    else:
        where = device or choose_device()
        if rtol is None:
            arithmetic = get_precision(precision or "double")
        else:
            worth = rows.shape[0] * len(directions) >= WORTH_MEASURING
            arithmetic = choose_precision(rtol, device=where, model=model, measure=worth).precision
        values = evaluate_directions(chosen, rows, directions, arithmetic, where)
    return values[:, 0] if vector.ndim == 1 else values


def evaluate_reference(model: Model, parameters: Array, directions: Directions) -> Array:
    """Return f (N, W) in 60 digits, rounded to float64.

    Raises
    ------
    InputError
        mpmath is not installed.
    """
    try:
        import mpmath
    except ImportError as error:
        raise InputError("precision 'reference' needs mpmath; install it with: pip install mpmath") from error
    check_reflection(directions)
    d = directions
    angles = list(zip(d.theta_i, d.phi_i, d.theta_r, d.phi_r, strict=True))
    with mpmath.workdps(REFERENCE_DIGITS):
        return np.array([[float(model.reference(p, *a)) for p in parameters] for a in angles])
