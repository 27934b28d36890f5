"""Remarks on a fit, and the search that a tolerance chose, in plain words; nothing reads them back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from clbrdf.fit.records import Search
from clbrdf.fit.remarks import Remark, Remarks
from clbrdf.instrument.place import CONES, LADDER

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
        aperture = scan.solid_angle is not None
        points = ("points; the aperture that the scan tells of is left out",)
        return (*(points if aperture else ()), *(apart if band else ()))
    names = [f"{name} {_cone(through, name)}" for k, name in enumerate(CONES) if k in through.cones]
    names += [name for name in through.instrument.on() if name not in (*CONES, "bandwidth")]
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


def span(values: Sequence[float], digits: int) -> str:
    """Return the range of some values, or the only one."""
    low, high = f"{min(values):.{digits}g}", f"{max(values):.{digits}g}"
    return low if low == high else f"{low} to {high}"


def _few_values(names: str, numbers: Numbers) -> str:
    values, free = (int(n) for n in numbers[0])
    return f"{names} cannot be determined: {values} value{'s' * (values != 1)} for {free} parameters"


def _few_angles(names: str, numbers: Numbers) -> str:
    seen, needed = (int(n) for n in numbers[0])
    angles = f"{seen} incident angle{'s' * (seen != 1)}"
    return f"{names} cannot be determined: {angles}, and {needed} are needed"


VARYING = ("correlated",)
"""Kinds whose numbers differ everywhere: gathered, they become a range."""

WORDS: dict[str, Callable[[str, Numbers], str]] = {
    "no lobe": lambda names, _: f"{names} cannot be determined: the data show no specular part",
    "few values": _few_values,
    "few angles": _few_angles,
    "undetermined": lambda names, _: f"{names} cannot be determined: other values fit as well",
    "at bound": lambda names, n: f"{names} is at its limit {n[0][0]:g}",
    "correlated": lambda names, n: f"{names} are hardly told apart: correlation {span([v[0] for v in n], 4)}",
}
"""What each kind of remark says of some parameters, with the numbers of all wavelengths where it holds."""
