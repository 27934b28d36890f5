"""How well a model predicts an incident angle that it has not seen.

Each incident zenith is left out in turn, the model is fitted to the others by the usual fit with the same
weights and masks, and what was left out is predicted. Points left out at random would not do: their
neighbours tell what they are, so that a model that follows every bend of a systematic error would win.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.choose.angles import AngleGroups
from clbrdf.fit.result import Fit
from clbrdf.objective import residual_scale
from clbrdf.scan import Scan

Array = npt.NDArray[np.float64]
Fitter = Callable[[Scan, npt.NDArray[np.intp]], Fit]
"""(scan of some of the directions, their places) -> its fit."""


@dataclass(frozen=True, eq=False)
class LeftOut:
    """What came of leaving out each incident angle.

    Attributes
    ----------
    score : (I, W) float64
        Mean over the values of an incident angle of N s² (f_predicted − f)², s the scale of E (13) over the
        whole scan: with relative weights the mean square of the relative deviation. NaN where nothing was
        measured, infinite where the prediction is not finite.
    milliseconds : (I,) float64
        Wall time of each fit a wavelength.
    """

    score: Array
    milliseconds: Array


def leave_out(scan: Scan, weights: Array, groups: AngleGroups, fitter: Fitter) -> LeftOut:
    """Leave out each incident angle in turn.

    Parameters
    ----------
    scan : Scan
        N directions × W wavelengths.
    weights : (N, W) float64
        g of (13) over the whole scan; 0 where a value is not used.
    groups : AngleGroups
    fitter : callable
    """
    scale = residual_scale(scan, weights)
    used, count = scale > 0.0, (scale > 0.0).sum(axis=0)
    score = np.full((len(groups.theta_i), len(scan.wavelength)), np.nan)
    seconds = np.full(len(groups.theta_i), np.nan)
    for k in range(len(groups.theta_i)):
        here = groups.group == k
        if not used[here].any():
            continue
        fit = fitter(scan.rows(~here), np.flatnonzero(~here))
        predicted = fit.predict_seen(scan.rows(here))
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            square = np.where(used[here], scale[here] * (predicted - scan.brdf[here]), 0.0) ** 2
            mean = count * square.sum(axis=0) / used[here].sum(axis=0)
        score[k] = np.where(np.isfinite(mean), mean, np.inf)
        score[k, used[here].sum(axis=0) == 0] = np.nan
        seconds[k] = fit.search.seconds
    return LeftOut(score, 1e3 * seconds / len(scan.wavelength))
