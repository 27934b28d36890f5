"""The simplest model within one paired standard error of the best.

Source: Hastie, Tibshirani and Friedman, The Elements of Statistical Learning (2nd ed., 2009), 7.10; paired
as in Nadeau and Bengio, Machine Learning 52 (2003), doi:10.1023/A:1024068626366: models are compared on the
same values, so that what is hard for all of them cancels.

The standard error is taken over the I incident angles, each the mean of its wavelengths: what is wrong with
a model or with an instrument at one incident angle is wrong at all wavelengths alike, so that wavelengths are
no independent witnesses. The fits share most of their data, so that their scores vary less than independent
ones: with one angle left out and I − 1 kept, variance/I becomes variance (1/I + 1/(I−1)).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

FAR_WORSE = 2.0
"""Times the mean score of the best from which a model is not within one standard error, however uncertain the
difference: a model that fails at a single incident angle alone has a difference of about one standard error,
whatever its size."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """M models beside the best of them.

    Attributes
    ----------
    mean : (M,) float64
        Mean score.
    above : (M,) float64
        Mean difference of the scores from the best model's.
    standard_error : (M,) float64
        Of that difference; 0 for the best.
    within : (M,) bool
        Whether the difference is at most its standard error, and the score at most FAR_WORSE times the best.
    best, chosen : int
        Places of the model of the lowest score, and of the simplest one within.
    """

    mean: Array
    above: Array
    standard_error: Array
    within: npt.NDArray[np.bool_]
    best: int
    chosen: int


def one_standard_error(scores: Array, parameters: npt.ArrayLike) -> Comparison:
    """Compare models on the same left-out values.

    Parameters
    ----------
    scores : (M, I, W) float64
        Of each model at each incident angle and wavelength, smaller is better; NaN where nothing was
        measured, for all models alike.
    parameters : (M,) int
        Of each model at one wavelength; fewer is simpler. Among equals the lower score is chosen.
    """
    seen = ~np.isnan(scores).all(axis=(0, 2))
    with np.errstate(invalid="ignore"):
        by_angle = np.nanmean(scores[:, seen], axis=2)
        mean = by_angle.mean(axis=1)
        best = int(np.argmin(mean))
        difference = by_angle - by_angle[best]
        count = by_angle.shape[1]
        error = difference.std(axis=1, ddof=1) * np.sqrt(1.0 / count + 1.0 / (count - 1.0))
    finite = np.isfinite(mean)
    above = np.where(finite, mean - mean[best], np.inf)
    error = np.where(finite, error, np.nan)
    within = finite & (above <= error) & (mean <= FAR_WORSE * mean[best])
    order = np.lexsort((mean, np.asarray(parameters), ~within))
    return Comparison(mean, above, error, within, best, int(order[0]))
