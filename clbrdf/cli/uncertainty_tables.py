"""Tables on uncertainties: components of a scan, what makes the error bars of a fit, draws beside them."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from clbrdf.cli.console import number, print_table
from clbrdf.fit.budget import budget_table, fitted_names, mean_table
from clbrdf.fit.result import Fit
from clbrdf.fit.words import departure_lines
from clbrdf.scan import Component, Scan
from clbrdf.scan.component import root_sum


def component_size(scan: Scan, one: Component) -> str:
    """Return how large a component is, in words: a percentage, or a median where it differs."""
    values = np.abs(np.asarray(one.values))
    if one.relative and values.min() == values.max():
        return f"{100.0 * values.flat[0]:.3g} %"
    good = ~scan.mask & (scan.brdf > 0.0)
    if not good.any():
        return "–"
    size = np.abs(one.absolute(scan.brdf))[good] / scan.brdf[good]
    return f"{100.0 * np.median(size):.3g} % (median)"


def print_components(scan: Scan) -> None:
    """Print the components of a scan's uncertainty, where it has any."""
    if not scan.components:
        return
    rows = [[one.name, component_size(scan, one), one.words()] for one in scan.components]
    print_table("", ("uncertainty", "1σ", "errors in common"), rows, left=3)


def print_parts(fit: Fit) -> None:
    """Print what makes the error bars of a fit, and its means over wavelengths."""
    if len(fit.estimate.parts) < 2:
        return
    title = "what makes the error bars: 1σ by component, median over wavelengths"
    rows = [[name, *("–" if v != v else number(v, 2) for v in values)] for name, values in budget_table(fit)]
    print_table(title, ("component", *fitted_names(fit)), rows, left=1)
    means = [
        [
            r.parameter,
            number(r.value, 4),
            *(number(v, 2) for v in (r.sigma, r.random, r.common)),
            str(r.count),
        ]
        for r in mean_table(fit)
    ]
    if means:
        columns = ("mean over wavelengths", "mean", "1σ", "random part", "common part", "wavelengths")
        print_table("", columns, means, left=1)


def print_draws(fit: Fit) -> None:
    """Print where draws leave the linear error bars."""
    if fit.monte_carlo is not None:
        rows = [[text] for text in departure_lines(fit.monte_carlo, fit.model.names, fit.wavelength)]
        print_table("", (f"Monte Carlo of {fit.monte_carlo.draws} draws",), rows, left=1)


def uncertainty_content(fit: Fit) -> dict[str, Any]:
    """Return parts, means and draws of a fit as plain values for JSON."""
    parts = fit.estimate.parts
    out: dict[str, Any] = {
        "components": [
            {"name": part.name, "errors_in_common": part.words, "is_common": part.is_common} for part in parts
        ],
        "budget": {
            name: {key: values.tolist() for key, values in fit.budget(name).items()}
            for name in fitted_names(fit)
        },
        "means": [asdict(row) for row in mean_table(fit)] if parts else [],
    }
    drawn = fit.monte_carlo
    if drawn is not None:
        out["monte_carlo"] = {
            "draws": drawn.draws,
            "seed": drawn.seed,
            "seconds": drawn.seconds,
            "intervals": {
                name: {
                    share: drawn.intervals[k, :, :, j].T.tolist()
                    for k, share in enumerate(("68.27 %", "95 %"))
                }
                for j, name in enumerate(fit.model.names)
                if name not in fit.given
            },
            "departs": {
                name: drawn.departs[:, j].tolist()
                for j, name in enumerate(fit.model.names)
                if name not in fit.given
            },
        }
    return out


def total_words(scan: Scan) -> str:
    """Return the random and the common part of a scan's uncertainties in words, "" without components."""
    good = ~scan.mask & (scan.brdf > 0.0)
    if not scan.components or not good.any():
        return ""
    random, common = scan.random_sigma, root_sum(scan.common_components, scan.brdf)
    share = 100.0 * np.median(common[good] / scan.brdf[good])
    told = "none" if random is None else f"{100.0 * np.nanmedian(random[good] / scan.brdf[good]):.3g} %"
    return f"random part {told}, common part {share:.3g} % (medians)"
