"""The simplest model within one paired standard error of the best.

Source: Hastie, Tibshirani and Friedman, The Elements of Statistical Learning (2nd ed., 2009), 7.10; paired
as in Nadeau and Bengio, Machine Learning 52 (2003), doi:10.1023/A:1024068626366: models are compared on the
same values, so that what is hard for all of them cancels.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


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
        Whether the difference is at most its standard error.
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
        Of each model at each incident angle and wavelength, smaller is better; NaN where nothing was measured,
        for all models alike.
    parameters : (M,) int
        Of each model at one wavelength; fewer is simpler. Among equals the lower score is chosen.
    """
    m = len(scores)
    flat = scores.reshape(m, -1)
    flat = flat[:, ~np.isnan(flat).all(axis=0)]
    mean = np.where(np.isnan(flat).any(axis=1), np.inf, flat.mean(axis=1))
    best = int(np.argmin(mean))
    with np.errstate(invalid="ignore"):
        difference = flat - flat[best]
        above = np.where(np.isfinite(mean), difference.mean(axis=1), np.inf)
        error = difference.std(axis=1, ddof=1) / np.sqrt(flat.shape[1])
    error = np.where(np.isfinite(mean), error, np.nan)
    within = above <= error
    order = np.lexsort((mean, np.asarray(parameters), ~within))
    return Comparison(mean, above, error, within, best, int(order[0]))
