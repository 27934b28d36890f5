"""The records that a fit is made of: what was asked, what was found, how good it is, how it was searched."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from clbrdf.records import Record

if TYPE_CHECKING:
    from clbrdf.fit.carried import Part
    from clbrdf.fit.tolerance import Rung

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Count = npt.NDArray[np.int64]

STATUSES = ("converged", "at bound", "ambiguous", "not converged", "no data", "no weight")
"""What a status says of one wavelength:

converged
    a stationary point inside the limits, and the data tell the parameters apart
at bound
    the same, with at least one parameter at its limit
ambiguous
    a stationary point, but other parameters fit as well: too few points or incident angles, or no
    specular part
not converged
    the polish ran out of iterations, or was asked to stop early (a tolerance)
no data
    every value is masked; the parameters are NaN
no weight
    no value has a weight: their standard uncertainties are unknown or 0, or their weights are 0; the
    parameters are NaN
"""


@dataclass(frozen=True, eq=False)
class Setup(Record):
    """What was asked of a fit, beside the scan and the model.

    Attributes
    ----------
    weights : (N, W) float64
        g of (13); 0 where a value is not fitted.
    weighting : str
        "none", "relative", "sigma", or "user" for weights of one's own.
    bounds : (P, 2) float64
        Limits of the parameters.
    fixed : mapping of str to (W,) float64
        Parameters that were not fitted: fixed, or the wavelength itself.
    shared : tuple of str
        Parameters that are one number for all wavelengths, fitted to all of them together.
    smooth, rtol : float or None
        As `clbrdf.fit` takes them.
    left_out : int
        Directions of the scan that were left out because they are of transmission.
    method : str
        What searched.
    seed : int
    gls : bool
        Whether correlations counted as weights, too (generalised least squares).
    """

    weights: Array
    weighting: str
    bounds: Array
    fixed: Mapping[str, Array] = field(default_factory=dict)
    shared: tuple[str, ...] = ()
    smooth: float | None = None
    rtol: float | None = None
    left_out: int = 0
    method: str = "auto"
    seed: int = 0
    gls: bool = False

    @property
    def fitted(self) -> npt.NDArray[np.intp]:
        """Places of the wavelengths that have a value of positive weight."""
        return np.flatnonzero((self.weights > 0.0).any(axis=0))


@dataclass(frozen=True, eq=False)
class Estimate(Record):
    """Parameters and what the data say of them, at W wavelengths.

    Attributes
    ----------
    vector : (W, P) float64
        Best values in the order of the model's table, in its units; NaN where there is no fit.
    sigma : (W, P) float64
        Standard uncertainties; NaN at a bound, infinite where the data cannot tell.
    correlation : (W, P, P) float64
        Of the uncertainties; NaN where one of the two parameters has none.
    condition : (W,) float64
        Condition number of the weighted derivatives, columns scaled to unit length; infinite where the data
        cannot tell parameters apart.
    at_bound : (W, P) bool
        Fitted parameters that stand at a limit. The uncertainties of the others hold with these held there.
    undetermined : (W, P) bool
        Fitted parameters that the data cannot tell.
    parts : tuple of Part
        What makes the uncertainties: each component of the scan's, carried to the parameters. Empty in files
        of before.
    lower, upper : (W, P) float64 or None
        Ends of the profile-likelihood intervals of 68.3 % (`clbrdf.fit.profile`), NaN for parameters that
        were not fitted; None unless they were asked for.
    """

    vector: Array
    sigma: Array
    correlation: Array
    condition: Array
    at_bound: Mask
    undetermined: Mask
    parts: tuple[Part, ...] = ()
    lower: Array | None = None
    upper: Array | None = None


@dataclass(frozen=True, eq=False)
class Goodness(Record):
    """How well the fitted model meets the scan, at W wavelengths; NaN where there is no fit.

    Attributes
    ----------
    objective : (W,) float64
        E of (13) with the weights used.
    relative_rms : (W,) float64
        σ_r of (14) over all directions.
    relative_rms_by_incident_angle : (I, W) float64
        σ_r of (14) for each of the scan's incident angles.
    degrees : (W,) float64
        Degrees of freedom ν: values less fitted parameters that are not at a limit. A parameter that W
        wavelengths share counts as 1/W of one.
    chi2_reduced : (W,) float64
        Σ ((measured − model)/σ)² / ν with the scan's standard uncertainties, over the values that were
        fitted; NaN unless all of them have one. It is the least possible only for weights "sigma". Where
        errors have something in common, as `clbrdf.fit.correlated` forms it.
    scatter : (W,) float64
        √(Σ g (measured − model)² / ν), which stands for the uncertainty of the values where the scan has
        none: a relative deviation for weights "relative", in 1/sr for weights "none", √(χ²/ν) for "sigma".
    lag_one, lag_score : (W,) float64
        Correlation of the deviations of neighbours along θr, near 0 for noise and towards 1 for a smooth
        misfit, and its t (`clbrdf.fit.goodness`); NaN without neighbours.
    lack_of_fit : (W,) float64
        F: variance of the model's deviations over that of repeated directions, near 1 where the model is
        right; NaN without repeats.
    repeats : (W,) int64
        Degrees of freedom of the repeats: values less different directions.
    """

    objective: Array
    relative_rms: Array
    relative_rms_by_incident_angle: Array
    degrees: Array
    chi2_reduced: Array
    scatter: Array
    lag_one: Array
    lag_score: Array
    lack_of_fit: Array
    repeats: Count


@dataclass(frozen=True, eq=False)
class Search(Record):
    """How the parameters were found, at W wavelengths.

    Attributes
    ----------
    device : str
        Where it ran.
    evaluations : (W,) int64
        Evaluations of E, search and polish together.
    starts, agreeing : (W,) int64
        Starts of the polish, and how many of them ended at the E that is reported. With shared parameters:
        walks to the joint optimum.
    acceptance : (W,) float64
        Share of proposed moves taken, NaN for methods that propose none.
    not_finite : (W,) int64
        Evaluations that were not finite and therefore refused.
    rungs : tuple of Rung
        The search that a tolerance (`rtol`) chose, and the next better one, as measured on `sample`
        wavelengths; empty without one. Not saved, as `seconds`.
    sample : int
    seconds : float
        Wall time of the fit. Not saved: a file holds only what input, settings and seed determine.
    """

    device: str
    evaluations: Count
    starts: Count
    agreeing: Count
    acceptance: Array
    not_finite: Count
    rungs: tuple[Rung, ...] = ()
    sample: int = 0
    seconds: float = float("nan")
