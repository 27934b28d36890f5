"""Whether the chosen model meets the data within their uncertainties, in words."""

from __future__ import annotations

import math
from collections.abc import Sequence

from clbrdf.choose.criteria import Criteria

FAR_ABOVE = 2.0
"""Reduced chi-squared from which no model fits: the misfit has as much variance as the uncertainties."""

SIGMAS = 5.0
"""By so many of its own standard deviations, √(2/degrees), it has to lie above 1 as well."""


def verdict(figures: Sequence[Criteria]) -> str:
    """Return "" where the best model fits, or uncertainties are not known; else why no model does."""
    known = [figure for figure in figures if not math.isnan(figure.chi2_reduced)]
    if not known:
        return ""
    best = min(known, key=lambda figure: figure.chi2_reduced)
    chi2 = best.chi2_reduced
    if chi2 <= max(FAR_ABOVE, 1.0 + SIGMAS * math.sqrt(2.0 / best.degrees)):
        return ""
    return (
        f"no model fits: even the best leaves a reduced chi-squared of {chi2:.3g}, so that deviations are"
        f" {math.sqrt(chi2):.2g} times the stated uncertainties; these are too small, or the models lack"
        " something of this surface or of the instrument"
    )
