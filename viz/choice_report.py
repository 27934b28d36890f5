"""The choice of a model on a page: its ranking, what it rests on, and where models miss the data."""

from __future__ import annotations

from html import escape

from clbrdf.choose.result import Choice
from clbrdf.choose.words import RANKING, choice_words, details, misfit_words, ranking_row
from clbrdf.viz.report_parts import figure, section, table
from clbrdf.viz.residual_maps import residual_maps, shown_models
from clbrdf.viz.score_chart import score_chart


def choice_sections(choice: Choice) -> list[str]:
    """Return the sections that stand before those of the fit."""
    words = "".join(f"<p>{escape(line)}</p>" for line in choice_words(choice))
    places = "".join(f"<li>{escape(text)}</li>" for text in misfit_words(choice))
    ranking = table(list(RANKING), [list(ranking_row(choice, row)) for row in choice.ranking])
    heads, rows = details(choice)
    skipped = "".join(
        f"<p>Not compared: {escape(entry.model)}: {escape(entry.reason)}.</p>" for entry in choice.skipped
    )
    score_words = (
        "Root mean square of what was predicted at each incident angle when it was left out (dots), and over"
        " all of them (bars)."
    )
    map_words = (
        "Model less measured, relative to measured, mean over the wavelengths of the ranking:"
        f" {', '.join(shown_models(choice))}."
    )
    return [
        section("Choice of the model", f"{words}<ul>{places}</ul>{skipped}{ranking}"),
        section("What left-out incident angles say", figure(lambda: score_chart(choice), "svg", score_words)),
        section("Where the models miss", figure(lambda: residual_maps(choice), "png", map_words)),
        section(
            "Mean residual (%) at each θi; reciprocity and reflectance", table(heads, list(map(list, rows)))
        ),
    ]
