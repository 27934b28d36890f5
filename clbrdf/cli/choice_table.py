"""A ranking of models, printed and as plain values."""

from __future__ import annotations

from typing import Any

from rich.padding import Padding

from clbrdf.choose import Choice, Ranked
from clbrdf.choose.words import RANKING, choice_words, details, misfit_words, ranking_row
from clbrdf.cli.console import print_table, stdout_console


def print_choice(title: str, choice: Choice) -> None:
    """Print the ranking, what is wrong with the models, and which one was chosen."""
    console = stdout_console()
    rows = [ranking_row(choice, row) for row in choice.ranking]
    print_table(f"{title}: models by what they predict", RANKING, rows)
    print_table("Mean residual at each θi, model less measured (%); the fitted surface", *details(choice))
    if choice.skipped:
        print_table("", ("not compared", ""), [[s.model, s.reason] for s in choice.skipped], left=2)
    for line in choice_words(choice):
        console.print(line)
    for text in misfit_words(choice):
        console.print(Padding(text, (0, 0, 0, 2)))


def choice_content(choice: Choice) -> dict[str, Any]:
    """Return a choice as plain values for JSON; NaN and infinite values become null there."""
    return {
        "sample": choice.fit.scan.sample,
        "chosen": choice.chosen,
        "weights": choice.weights,
        "verdict": choice.verdict,
        "misfit": list(choice.misfit),
        "thin": list(choice.thin),
        "without_one_angle": list(choice.steady),
        "theta_i": choice.theta_i.tolist(),
        "wavelength": choice.fit.wavelength[choice.places].tolist(),
        "columns": [choice.fit.scan.labels[k] for k in choice.places],
        "wavelengths": len(choice.fit.wavelength),
        "skipped": [{"model": s.model, "reason": s.reason} for s in choice.skipped],
        "provenance": dict(choice.fit.provenance),
        "ranking": [_content(row) for row in choice.ranking],
    }


def _content(row: Ranked) -> dict[str, Any]:
    numbers = ["predicted", "above", "standard_error", "relative_rms", "aicc", "bic", "chi2_reduced"]
    numbers += ["lag_one", "exchange", "reflectance", "cut", "milliseconds"]
    return {
        "model": row.model,
        "parameters_fitted": row.free,
        "within": row.within,
        **{name: getattr(row, name) for name in numbers},
        "score": row.score.tolist(),
        "mean_residual": row.mean_residual.tolist(),
        "parameters": {name: values.tolist() for name, values in row.parameters.items()},
    }
