"""The choice between models: fitted alike, judged by incident angles that they have not seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from clbrdf.choose.angles import incident_groups
from clbrdf.choose.candidates import DEFAULT_CANDIDATES, Skipped, fixed_of, resolve, sift, thin_wavelengths
from clbrdf.choose.rank import Work, rank_one
from clbrdf.choose.residuals import worst_places
from clbrdf.choose.result import Choice, Ranked
from clbrdf.choose.rule import one_standard_error
from clbrdf.choose.verdict import verdict
from clbrdf.errors import InputError
from clbrdf.fit import fit
from clbrdf.fit.through import SCAN
from clbrdf.models import Model, Page
from clbrdf.objective import weight_matrix
from clbrdf.opencl.device import Device, usable_device
from clbrdf.progress import Report, silent
from clbrdf.scan import Scan

if TYPE_CHECKING:
    from clbrdf.instrument.settings import Instrument

__all__ = ["DEFAULT_CANDIDATES", "Choice", "Ranked", "Skipped", "choose", "usual_weights"]

Array = npt.NDArray[np.float64]

RANKED_WAVELENGTHS = 32
"""A ranking is made at so many wavelengths, spread evenly, where a scan has more."""


def choose(
    scan: Scan,
    models: Sequence[str | Model | Page] | str | None = None,
    *,
    weights: str | npt.ArrayLike | None = None,
    fix: Mapping[str, npt.ArrayLike] | None = None,
    wavelengths: int | None = RANKED_WAVELENGTHS,
    method: str = "auto",
    seed: int = 0,
    through: str | Path | Instrument = SCAN,
    force: bool = False,
    device: Device | str | None = None,
    report: Report = silent,
) -> Choice:
    """Say which model describes a scan: the simplest that predicts as well as the best.

    Every model is fitted to the scan, and again without each incident angle in turn, which it then has to
    predict. Chosen is the model of the fewest parameters whose mean squared deviation lies within one
    standard error of the lowest; differences are taken pair by pair over incident angles and wavelengths.

    Parameters
    ----------
    scan : Scan
        Three incident zeniths or more. Directions of transmission are left out.
    models : sequence of str, Model or Page, or str, optional
        Names as `get_model` takes them, or a text of them joined by commas. "default" among them stands for
        the usual candidates, which are taken where none are named.
    weights : "none", "relative", "sigma" or (N,) array, optional
        As of `fit`, the same for all models; "sigma" where every value has an uncertainty, else "relative",
        where none are named.
    fix : mapping of str to float or (W,) array, optional
        Parameters that are not fitted, in all models that have them.
    wavelengths : int or None
        The ranking is made at so many of the scan's wavelengths, spread evenly; None: at all. The chosen
        model is fitted at all of them in any case.
    method : str
        Of the fits.
    seed : int
    through : str, Path or Instrument
        As of `fit`, the same for all models.
    force : bool
        Allow sums of whole surfaces.
    device : Device or str, optional
    report : callable
        Called with (fits done, fits in all).

    Returns
    -------
    Choice

    Raises
    ------
    InputError
        Fewer than three incident angles, an unknown model, a sum of whole surfaces without `force`, no model
        that the scan has values enough for, or as `fit`.
    DeviceError
        No OpenCL device with fp64.
    """
    if not isinstance(scan, Scan):
        raise InputError(f"choose takes a Scan, not {type(scan).__name__}; open a file with clbrdf.Scan.open")
    if wavelengths is not None and not (isinstance(wavelengths, int) and wavelengths >= 1):
        raise InputError(f"wavelengths is {wavelengths}; give a whole number of 1 or more, or None for all")
    given = dict(fix or {})
    models_asked = resolve(scan, models, given, force)
    if weights is not None and not isinstance(weights, str) and np.shape(weights) == (len(scan),):
        weights = np.asarray(weights)[~scan.transmitted]
    scan = scan.reflection()
    named = usual_weights(scan) if weights is None else weights
    g, where = weight_matrix(scan, named), usable_device(device)
    groups = incident_groups(scan)
    thin = thin_wavelengths(scan, models_asked, given, g > 0.0, groups)
    places = _ranked_places(np.where(thin, 0.0, g), wavelengths)
    part = scan.columns(places)
    known = {name: _at(value, places, len(scan.wavelength)) for name, value in given.items()}
    candidates, skipped = sift(part, models_asked, known, g[:, places] > 0.0, groups)
    work = Work(part, groups, g[:, places], named, method, seed, where, through)
    rows, figures = [], []
    for k, candidate in enumerate(candidates):
        report(k, len(candidates) + 1)
        row, criteria = rank_one(work, candidate)
        rows.append(row)
        figures.append(criteria)
    report(len(candidates), len(candidates) + 1)
    compared = one_standard_error(np.stack([row.score for row in rows]), [row.free for row in rows])
    chosen = candidates[compared.chosen]
    own = fixed_of(chosen.model, given)
    final = fit(
        scan,
        model=chosen.model,
        weights=named,
        fix=own,
        method=method,
        seed=seed,
        through=through,
        device=where,
    )
    report(len(candidates) + 1, len(candidates) + 1)
    values = final.observed()[:, places]
    return Choice(
        ranking=tuple(
            replace(
                rows[k],
                above=float(compared.above[k]),
                standard_error=float(compared.standard_error[k]),
                within=bool(compared.within[k]),
                predicted=float(np.sqrt(compared.mean[k])),
            )
            for k in np.argsort(compared.mean, kind="stable")
        ),
        chosen=chosen.model.name,
        fit=final,
        theta_i=groups.theta_i,
        places=places,
        skipped=tuple(skipped),
        thin=tuple(scan.labels[k] for k in np.flatnonzero(thin)),
        verdict=verdict(figures),
        misfit=tuple(place.words() for place in worst_places(part, work.weights, values, groups)),
        weights=final.provenance["weights"],
    )


def _ranked_places(weights: Array, most: int | None) -> npt.NDArray[np.intp]:
    """Places of the wavelengths of the ranking: those with data, at most so many, spread evenly.

    Raises
    ------
    InputError
        No value is usable.
    """
    usable = np.flatnonzero((weights > 0.0).any(axis=0))
    if not len(usable):
        raise InputError("nothing to fit: no value has a weight; all are masked or have no uncertainty")
    if most is None or len(usable) <= most:
        return usable
    return usable[np.linspace(0, len(usable) - 1, most).round().astype(np.intp)]


def _at(value: npt.ArrayLike, places: npt.NDArray[np.intp], wavelengths: int) -> npt.ArrayLike:
    """Return a fixed parameter at some of the wavelengths; what has another length is for `fit` to refuse."""
    return np.asarray(value)[places] if np.shape(value) == (wavelengths,) else value


def usual_weights(scan: Scan) -> str:
    """Return "sigma" where every value that is not masked has an uncertainty above 0, else "relative"."""
    known = scan.sigma is not None and bool((scan.sigma[~scan.mask] > 0.0).all())
    return "sigma" if known else "relative"
