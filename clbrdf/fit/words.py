"""Remarks on a fit, and the search that a tolerance chose, in plain words; nothing reads them back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from clbrdf.fit.montecarlo import MonteCarlo
from clbrdf.fit.records import Search
from clbrdf.fit.remarks import Remark, Remarks
from clbrdf.instrument.rules import CONES, LADDER

if TYPE_CHECKING:
    from clbrdf.fit.result import Fit
    from clbrdf.fit.through import Through

Array = npt.NDArray[np.float64]

SEPARATOR = "; "


def remark_words(remark: Remark) -> str:
    """Return one remark in words."""
    return WORDS[remark.kind](listed(remark.parameters), [remark.numbers])


def remarks_line(remarks: Remarks) -> str:
    """Return the remarks on one wavelength in words, "" where there are none."""
    return SEPARATOR.join(remark_words(remark) for remark in remarks)


def gathered(remarks: Sequence[Remarks], wavelength: Array) -> list[tuple[str, Array]]:
    """Return each remark once, in words, with the wavelengths (nm) where it holds; the most frequent first.

    Numbers that differ from wavelength to wavelength become a range.
    """
    places: dict[tuple[object, ...], tuple[list[Remark], list[float]]] = {}
    for here, nm in zip(remarks, wavelength, strict=True):
        for remark in here:
            key = (remark.kind, remark.parameters, () if remark.kind in VARYING else remark.numbers)
            found, where = places.setdefault(key, ([], []))
            found.append(remark)
            where.append(float(nm))
    ordered = sorted(places.values(), key=lambda item: -len(item[1]))
    return [
        (WORDS[found[0].kind](listed(found[0].parameters), [r.numbers for r in found]), np.array(where))
        for found, where in ordered
    ]


def search_lines(search: Search) -> tuple[str, ...]:
    """Return what a tolerance chose, and the next better search, in words; empty without a tolerance."""
    told = [str(rung) for rung in search.rungs]
    return (f"{told[0]} (measured on {search.sample} of them)", *told[1:]) if told else ()


def through_lines(fit: Fit) -> tuple[str, ...]:
    """Return what a fit took the detector to see, in words; empty where nothing tells of an instrument."""
    through, scan = fit.through, fit.scan
    band = scan.bandpass is not None and (through is None or through.instrument.bandwidth is None)
    apart = ("the scan's bandpass is left out; smooth fits take one as wide as wavelengths are apart",)
    if through is None:
        told = [*scan.effects, *(["aperture"] if scan.solid_angle is not None else [])]
        verb = "is" if len(told) == 1 else "are"
        points = (f"points; the {listed(told)} that the scan tells of {verb} left out",)
        return (*(points if told else ()), *(apart if band else ()))
    names = [f"{name} {_cone(through, name)}" for k, name in enumerate(CONES) if k in through.cones]
    footprint, misalignment = through.instrument.footprint, through.instrument.misalignment
    if footprint is not None:
        names.append(f"footprint of {footprint.beam:.4g} mm in a field of {footprint.field:.4g} mm")
    if misalignment is not None:
        names.append(f"misalignment by a tilt of {misalignment.tilt:.4g}° and {misalignment.height:.4g} mm")
    if through.instrument.bandwidth is not None:
        names.append(f"bandwidth {through.instrument.bandwidth.width:.4g} nm")
    lines = [f"{', '.join(names)}, as {through.source} says"]
    for k in through.cones:
        rules = [LADDER[level] for level in np.unique(through.levels[:, k])]
        parts = []
        for kind, words in (
            ("point", "as points"),
            ("rings", "by rings"),
            ("peak", "by circles about the peak"),
        ):
            chosen = [rule for rule in rules if rule.kind == kind]
            count = sum(int((through.levels[:, k] == LADDER.index(rule)).sum()) for rule in chosen)
            if count:
                nodes = f" ({span([rule.count for rule in chosen], 4)} nodes)" if kind != "point" else ""
                parts.append(f"{count} {words}{nodes}")
        lines.append(f"{CONES[k]}: of {len(through.levels)} directions {', '.join(parts)}")
    return (*lines, *(apart if band else ()))


def _cone(through: Through, name: str) -> str:
    if name == "beam":
        assert through.instrument.beam is not None
        return f"{through.instrument.beam.angle:.4g}°"
    assert through.angle is not None
    return f"{span(through.angle[through.angle > 0.0].tolist(), 4)}°"


def listed(names: Sequence[str]) -> str:
    """Return names as a list in a sentence."""
    return " and ".join(filter(None, [", ".join(names[:-1]), *names[-1:]]))


Numbers = Sequence[tuple[float, ...]]


def plain(value: float, digits: int) -> str:
    """Return a number in few characters: `digits` significant ones, no exponent below 10⁶, "–" for NaN."""
    if value != value:
        return "–"
    return f"{value:.0f}" if 10.0**digits <= abs(value) < 1e6 else f"{value:.{digits}g}"


def span(values: Sequence[float], digits: int) -> str:
    """Return the range of some values, or the only one."""
    low, high = plain(min(values), digits), plain(max(values), digits)
    return low if low == high else f"{low} to {high}"


def _few_values(names: str, numbers: Numbers) -> str:
    values, free = (int(n) for n in numbers[0])
    return f"{names} cannot be determined: {values} value{'s' * (values != 1)} for {free} parameters"


def _few_angles(names: str, numbers: Numbers) -> str:
    seen, needed = (int(n) for n in numbers[0])
    angles = f"{seen} incident angle{'s' * (seen != 1)}"
    return f"{names} cannot be determined: {angles}, and {needed} are needed"


def _misfit(_: str, numbers: Numbers) -> str:
    chi2 = span([n[0] for n in numbers], 3)
    return (
        f"the model does not describe the data within their uncertainties: χ²/ν = {chi2};"
        " the error bars of its parameters do not count this"
    )


def _other_weights(_: str, numbers: Numbers) -> str:
    chi2 = span([n[0] for n in numbers], 3)
    return (
        f"the fit does not describe the data within their uncertainties: χ²/ν = {chi2}; its weights do not"
        " use them, and a fit with weights sigma shows whether the model can"
    )


def _lack_of_fit(_: str, numbers: Numbers) -> str:
    times = span([n[0] ** 0.5 for n in numbers], 2)
    return f"the model does not describe the data: it misses them by {times} times the scatter of repeats"


def _azimuth(_: str, numbers: Numbers) -> str:
    change, share = span([100.0 * n[0] for n in numbers], 2), span([100.0 * n[1] for n in numbers], 2)
    return (
        f"the data change with the incident azimuth by {change} %, {share} % of E, and the model cannot:"
        " take an anisotropic one"
    )


def _neighbours(_: str, numbers: Numbers) -> str:
    correlation = span([n[0] for n in numbers], 2)
    return (
        f"deviations of neighbours along θr go together (correlation {correlation}):"
        " the model misses something there, or neighbours share an error"
    )


def _overstated(_: str, numbers: Numbers) -> str:
    chi2 = span([n[0] for n in numbers], 2)
    return (
        f"the values scatter less than their uncertainties say: χ²/ν = {chi2};"
        " the uncertainties are too large, or shared by many values"
    )


def _left_out(why: str) -> Callable[[str, Numbers], str]:
    def words(_: str, numbers: Numbers) -> str:
        count = span([n[0] for n in numbers], 6)
        return f"{count} value{'s' * (count != '1')} {why}, and were not fitted"

    return words


VARYING = (
    *("misfit", "other weights", "lack of fit", "azimuth", "neighbours", "overstated", "correlated"),
    *("without sigma", "sigma of 0", "not positive"),
)
"""Kinds whose numbers differ everywhere: gathered, they become a range."""

WORDS: dict[str, Callable[[str, Numbers], str]] = {
    "misfit": _misfit,
    "other weights": _other_weights,
    "lack of fit": _lack_of_fit,
    "azimuth": _azimuth,
    "neighbours": _neighbours,
    "overstated": _overstated,
    "without sigma": _left_out("have no standard uncertainty, which the weights need"),
    "sigma of 0": _left_out("have a standard uncertainty of 0, which cannot be a weight"),
    "not positive": _left_out("are at or below 0, where relative weights have no meaning"),
    "no lobe": lambda names, _: f"{names} cannot be determined: the data show no specular part",
    "few values": _few_values,
    "few angles": _few_angles,
    "undetermined": lambda names, _: f"{names} cannot be determined: other values fit as well",
    "at bound": lambda names, n: (
        f"{names} is at its limit {n[0][0]:g}: the error bars of the others are given {names} = {n[0][0]:g}"
    ),
    "correlated": lambda names, n: f"{names} are hardly told apart: correlation {span([v[0] for v in n], 4)}",
}
"""What each kind of remark says of some parameters, with the numbers of all wavelengths where it holds."""


def departure_lines(drawn: MonteCarlo, names: Sequence[str], wavelength: Array) -> list[str]:
    """Return in words where the intervals of draws leave the linear error bars."""
    lines = []
    for j, name in enumerate(names):
        here = np.flatnonzero(drawn.departs[:, j])
        if len(here) == 0:
            continue
        nm = wavelength[here]
        where = f"{len(here)} of {len(drawn.departs)} wavelengths"
        if len(here) == 1 and np.isfinite(nm[0]):
            where = f"{nm[0]:g} nm"
        bound = float(np.nanmax(drawn.at_bound[here, j]))
        why = f"; up to {100.0 * bound:.0f} % of the draws end at a limit" if bound > 0.0 else ""
        lines.append(
            f"{name}: the intervals leave p ± σ by more than 10 % at {where}{why}; take those of the draws"
        )
    worst = float(np.nanmin(drawn.converged)) if np.isfinite(drawn.converged).any() else 1.0
    if not lines:
        lines.append("the intervals agree with p ± σ to 10 %, for every parameter at every wavelength")
    if worst < 1.0:
        lines.append(f"{100.0 * (1.0 - worst):.1f} % of the draws did not converge at the worst wavelength")
    return lines
