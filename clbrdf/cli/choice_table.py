"""A ranking of models as a table, in words and as plain values."""

from __future__ import annotations

from typing import Any

import numpy as np
from rich.padding import Padding

from clbrdf.choose import Choice, Ranked
from clbrdf.cli.console import number, print_table, stdout_console

MOST_ANGLES = 8
"""Incident angles that have a column of their own."""

EXCHANGE_MARGIN = 1e-4
ENERGY_MARGIN = 1e-6


def print_choice(title: str, choice: Choice) -> None:
    """Print the ranking, what is wrong with the models, and which one was chosen."""
    console = stdout_console()
    print_table(f"{title}: models by what they predict", _HEADS, [_row(choice, r) for r in choice.ranking])
    _print_details(choice)
    if choice.skipped:
        print_table("", ("not compared", ""), [[s.model, s.reason] for s in choice.skipped], left=2)
    for line in choice_words(choice):
        console.print(line)
    for text in choice.misfit:
        console.print(Padding(text, (0, 0, 0, 2)))


_HEADS = ("model", "par", "left out (%)", "± best", "whole (%)", "ΔAICc", "ΔBIC", "χ²/ν", "lag 1", "ms")


def _row(choice: Choice, row: Ranked) -> list[str]:
    aicc = min(other.aicc for other in choice.ranking)
    bic = min(other.bic for other in choice.ranking)
    marked = "> " if row.model == choice.chosen else "  "
    return [
        marked + row.model,
        str(row.free),
        number(100.0 * row.predicted, 3),
        _standing(row),
        number(100.0 * row.relative_rms, 3),
        _difference(row.aicc - aicc),
        _difference(row.bic - bic),
        number(row.chi2_reduced, 3),
        number(row.lag_one, 2),
        number(row.milliseconds, 2),
    ]


def _standing(row: Ranked) -> str:
    """By how many standard errors a model is worse than the best."""
    if row.above == 0.0:
        return "best"
    if not np.isfinite(row.above):
        return "–"
    return f"{row.above / row.standard_error:.1f} se" if row.standard_error > 0.0 else "–"


def _difference(value: float) -> str:
    return f"{value:.0f}" if np.isfinite(value) else "–"


def _print_details(choice: Choice) -> None:
    """Print what the residuals and the fitted surface of each model look like."""
    angles = choice.theta_i if len(choice.theta_i) <= MOST_ANGLES else choice.theta_i[:0]
    heads = ["model", *(f"θi {angle:.3g}°" for angle in angles), "exchange", "reflects"]
    rows = []
    for row in choice.ranking:
        means = [f"{100.0 * value:+.1f}" for value in row.mean_residual[: len(angles)]]
        exchange = "1" if row.exchange - 1.0 <= EXCHANGE_MARGIN else f"× {row.exchange:.3g}"
        cut = f" to {row.cut:g}°" if row.cut < 90.0 else ""
        rows.append([row.model, *means, exchange, number(row.reflectance, 3) + cut])
    print_table("Mean residual at each θi, model less measured (%); the fitted surface", heads, rows)


def choice_words(choice: Choice) -> list[str]:
    """Return what the ranking comes to."""
    best, chosen = choice.best, choice.of(choice.chosen)
    w, shown = len(choice.fit.wavelength), len(choice.places)
    where = f"{shown} of {w} wavelengths" if shown < w else f"{w} wavelength{'s' if w > 1 else ''}"
    lines = [
        f"Ranked at {where}, weights {choice.weights}, each of {len(choice.theta_i)} incident angles left out"
        " in turn: 'left out' is the deviation of what was predicted, 'whole' that of the fit to all (median"
        " σr)."
    ]
    if chosen is best:
        lines.append(
            f"{chosen.model} predicts best, and no simpler model is within one standard error of it."
        )
    else:
        lines.append(
            f"{best.model} predicts best; {chosen.model} is the simplest within one standard error of it:"
            f" {chosen.free} parameters in place of {best.free}."
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
    elif np.isnan(best.chi2_reduced):
        lines.append(
            "Whether any model fits is not known: the weights are not the scan's uncertainties. A correlation"
            " of neighbouring residuals (lag 1) near 0 would be noise, one near 1 is a misfit."
        )
    if choice.misfit:
        lines.append(f"Where {chosen.model} misses most:")
    return lines


def choice_content(choice: Choice) -> dict[str, Any]:
    """Return a choice as plain values for JSON; NaN and infinite values become null there."""
    return {
        "sample": choice.fit.scan.sample,
        "chosen": choice.chosen,
        "weights": choice.weights,
        "verdict": choice.verdict,
        "misfit": list(choice.misfit),
        "without_one_angle": list(choice.steady),
        "theta_i": choice.theta_i.tolist(),
        "wavelength": choice.fit.wavelength[choice.places].tolist(),
        "wavelengths": len(choice.fit.wavelength),
        "skipped": [{"model": s.model, "reason": s.reason} for s in choice.skipped],
        "provenance": dict(choice.fit.provenance),
        "ranking": [_content(row) for row in choice.ranking],
    }


def _content(row: Ranked) -> dict[str, Any]:
    numbers = ("predicted", "above", "standard_error", "relative_rms", "aicc", "bic", "chi2_reduced")
    numbers += ("lag_one", "exchange", "reflectance", "cut", "milliseconds")
    return {
        "model": row.model,
        "parameters_fitted": row.free,
        "within": row.within,
        **{name: getattr(row, name) for name in numbers},
        "score": row.score.tolist(),
        "mean_residual": row.mean_residual.tolist(),
        "parameters": {name: values.tolist() for name, values in row.parameters.items()},
    }
