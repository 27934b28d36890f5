"""A ranking of models as rows of text, and in words."""

from __future__ import annotations

import numpy as np

from clbrdf.choose.result import Choice, Ranked
from clbrdf.choose.rule import FAR_WORSE

MOST_ANGLES = 8
"""Incident angles that have a column of their own."""

MEETS = 1.2
"""Reduced chi-squared up to which residuals are what the uncertainties allow."""

MOST_THIN = 8
"""Wavelengths that are named."""

EXCHANGE_MARGIN = 1e-4
"""Factors nearer to 1 are rounding."""


RANKING = ("model", "par", "left out (%)", "± best", "whole (%)", "ΔAICc", "ΔBIC", "χ²/ν", "lag 1", "ms")


def ranking_row(choice: Choice, row: Ranked) -> list[str]:
    """Return a model's row under RANKING; the chosen one is marked."""
    aicc = min(other.aicc for other in choice.ranking)
    bic = min(other.bic for other in choice.ranking)
    marked = "> " if row.model == choice.chosen else "  "
    return [
        marked + row.model,
        str(row.free),
        _number(100.0 * row.predicted, 3),
        _standing(choice, row),
        _number(100.0 * row.relative_rms, 3),
        _difference(row.aicc - aicc),
        _difference(row.bic - bic),
        _number(row.chi2_reduced, 3),
        _number(row.lag_one, 2),
        _number(row.milliseconds, 2),
    ]


def _standing(choice: Choice, row: Ranked) -> str:
    """By how many standard errors a model is worse than the best, or that it is far worse."""
    if row.above == 0.0:
        return "best"
    if not np.isfinite(row.above):
        return "–"
    if row.predicted**2 > FAR_WORSE * choice.best.predicted**2:
        return "far"
    return f"{row.above / row.standard_error:.1f} se" if row.standard_error > 0.0 else "–"


def _difference(value: float) -> str:
    return f"{value:.0f}" if np.isfinite(value) else "–"


def details(choice: Choice) -> tuple[list[str], list[list[str]]]:
    """Return heads and rows: mean residual at each θi, reciprocity and reflectance of each model."""
    angles = choice.theta_i if len(choice.theta_i) <= MOST_ANGLES else choice.theta_i[:0]
    heads = ["model", *(f"θi {angle:.3g}°" for angle in angles), "exchange", "reflects"]
    rows = []
    for row in choice.ranking:
        means = [f"{100.0 * value:+.1f}" for value in row.mean_residual[: len(angles)]]
        exchange = "1" if row.exchange - 1.0 <= EXCHANGE_MARGIN else f"× {row.exchange:.3g}"
        cut = f" to {row.cut:g}°" if row.cut < 90.0 else ""
        rows.append([row.model, *means, exchange, _number(row.reflectance, 3) + cut])
    return heads, rows


def choice_words(choice: Choice) -> list[str]:
    """Return what the ranking comes to."""
    best, chosen = choice.best, choice.of(choice.chosen)
    w, shown = len(choice.fit.wavelength), len(choice.places)
    where = f"{shown} of {w} wavelengths" if shown < w else f"{w} wavelength{'s' if w > 1 else ''}"
    lines = [
        f"Ranked at {where}, weights {choice.weights}, each of {len(choice.theta_i)} incident angles left out"
        " in turn: 'left out' is the deviation of what was predicted, 'whole' that of the fit to all (median"
        " σr). '± best': by how many paired standard errors (se) it is worse than the best; far: its mean"
        f" square is more than {FAR_WORSE:g} times as large."
    ]
    if choice.thin:
        count, listed = len(choice.thin), ", ".join(choice.thin[:MOST_THIN])
        more = ", …" if count > MOST_THIN else ""
        lines.append(f"Not in the ranking, for too few values to fit every model: {listed}{more}.")
    if chosen is best:
        lines.append(
            f"{chosen.model} predicts best, and no simpler model is within one standard error of it."
        )
    else:
        lines.append(
            f"{best.model} predicts best; {chosen.model} is the simplest within one standard error of it:"
            f" {chosen.free} parameter{'s' * (chosen.free != 1)} in place of {best.free}."
        )
    if choice.steady:
        same = sum(name == choice.chosen for name in choice.steady)
        others = sorted({name for name in choice.steady if name != choice.chosen})
        also = f"; else {', '.join(others)}" if others else ""
        lines.append(
            f"Without the evidence of one incident angle the choice is the same {same} of"
            f" {len(choice.steady)} times{also}."
        )
    if choice.verdict:
        lines.append(choice.verdict[0].upper() + choice.verdict[1:] + ".")
    elif chosen.chi2_reduced <= MEETS:
        lines.append(
            f"{chosen.model} leaves a reduced chi-squared of {chosen.chi2_reduced:.3g}: about what the scan's"
            " uncertainties allow."
        )
    elif np.isfinite(chosen.chi2_reduced):
        lines.append(
            f"{chosen.model} leaves a reduced chi-squared of {chosen.chi2_reduced:.3g}, more than the scan's"
            " uncertainties allow."
        )
    else:
        lines.append(
            "Whether any model fits is not known: the weights are not the scan's uncertainties. A correlation"
            " of neighbouring residuals (lag 1) near 0 would be noise, one near 1 is a misfit."
        )
    if misfit_words(choice):
        lines.append(f"Where {chosen.model} misses most:")
    return lines


def misfit_words(choice: Choice) -> tuple[str, ...]:
    """Return where the chosen model misses most; nothing where its residuals are what uncertainties allow."""
    return () if choice.of(choice.chosen).chi2_reduced <= MEETS else choice.misfit


def _number(value: float, digits: int) -> str:
    return "–" if value != value else f"{value:.{digits}g}"
