"""Model values on the device."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.geometry import Directions, check_reflection
from clbrdf.models import DEFAULT_MODEL, Model, Page, get_model
from clbrdf.opencl.cheapest import choose_precision
from clbrdf.opencl.device import Device, usable_device
from clbrdf.opencl.precision import get_precision
from clbrdf.opencl.values import evaluate_directions

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
    phi_i: npt.ArrayLike = 0.0,
    wavelength: npt.ArrayLike | None = None,
    model: str | Model | Page = DEFAULT_MODEL,
    precision: str | None = None,
    rtol: float | None = None,
    device: Device | str | None = None,
) -> Array:
    """Evaluate a model in N directions for one parameter set or for W of them.

    Parameters
    ----------
    parameters : mapping of str to float or (W,) array
        By name, in the units of the model's table; missing ones take the table's default.
    theta_i, theta_r, phi : float or (N,) array
        Degrees; zeniths in [0, 90), φ = φr − φi with 180 forward. Lengths broadcast.
    phi_i : float or (N,) array
        Incident azimuth on the sample, degrees, for models of surfaces with a direction of their own; others
        do not depend on it.
    wavelength : float or (W,) array, optional
        nm, for models that depend on the wavelength itself; others do not look at it.
    model : str, Model or Page
        A name, such as "ggx+minnaert" (`clbrdf.models.get_model`).
    precision : str
        Arithmetic of the work: "fast" (or "fast:3" to "fast:6", the degree of its exp2), "single",
        "double", each with the bound that clbrdf.opencl.precision states; or "reference", the published
        equations in 60 digits, rounded to float64, slow and without a device (needs mpmath). By default
        "double".
    rtol : float, optional
        In place of a precision: the cheapest that keeps this relative tolerance, as `choose_precision`
        tells. For a million values or more the costs are measured where they are not known yet.
    device : Device or str, optional
        From `clbrdf.opencl.device.choose_device`, or part of its name; the preferred one if not given.

    Returns
    -------
    (N,) or (N, W) float64
        BRDF in 1/sr, without the cosine. Values that leave the range of single precision are computed in
        double, so that none is infinite because of the arithmetic chosen.

    Raises
    ------
    InputError
        Unknown model, parameter or precision, a parameter without a default that is not given, angles out of
        range, lengths that do not agree, both a precision and a tolerance, a tolerance that cannot be kept.
    DeviceError
        No usable OpenCL device.
    """
    if rtol is not None and precision is not None:
        raise InputError("precision and rtol both choose the arithmetic; give one of them")
    chosen = get_model(model)
    vector = chosen.vector(with_wavelength(chosen, parameters, wavelength))
    azimuth = np.asarray(phi_i, dtype=np.float64)
    directions = Directions.relative(theta_i, theta_r, phi, azimuth)
    rows = np.atleast_2d(vector)
    if precision == REFERENCE:
        values = evaluate_reference(chosen, rows, directions)
    else:
        where = usable_device(device)
        if rtol is None:
            arithmetic = get_precision(precision or "double")
        else:
            worth = rows.shape[0] * len(directions) >= WORTH_MEASURING
            arithmetic = choose_precision(rtol, device=where, model=chosen, measure=worth).precision
        values = evaluate_directions(chosen, rows, directions, arithmetic, where)
    return values[:, 0] if vector.ndim == 1 else values


def with_wavelength(
    model: Model, parameters: Mapping[str, npt.ArrayLike], wavelength: npt.ArrayLike | None
) -> dict[str, npt.ArrayLike]:
    """Return parameters by their full names, with the wavelength (nm) where a model depends on it.

    Raises
    ------
    InputError
        An unknown parameter, a wavelength that is not given and needed, not positive, or given twice.
    """
    named = model.by_full_name(parameters)
    rows = [row.name for row in model.parameters if row.given == "wavelength"]
    if wavelength is None:
        if not all(name in named for name in rows):
            raise InputError(f"model {model.name} depends on the wavelength itself; give wavelength in nm")
        return named
    nm = np.asarray(wavelength, dtype=np.float64)
    if not (np.isfinite(nm) & (nm > 0.0)).all():
        raise InputError(f"wavelength is {nm.flat[0]:g} nm; it has to be above 0")
    for name in rows:
        if name in named:
            raise InputError(f"the wavelength is given twice, as wavelength and as parameter {name}")
        named[name] = nm
    return named


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
