"""The components of a calibrated scan's uncertainty, with what their errors have in common.

Counting and reading belong to one value. A dark spectrum is shared by a run of rows, a reading of the direct
beam or the panel by another: their errors are one error for the run. A stage that stops a little off is off
for as long as it stands there. Solid angle, panel, nonlinearity and reader are one error for all.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.rig.budget import Budget, ErrorSource
from clbrdf.rig.rawscan import RawScan
from clbrdf.rig.row import NO_ROW
from clbrdf.rig.uncertainty import MEDIAN_OF_THREE, angle_sigmas
from clbrdf.scan import Component, Correlation, Scan

Array = npt.NDArray[np.float64]
Rows = npt.NDArray[np.intp]

RANDOM, SYSTEMATIC = Correlation("random"), Correlation("systematic")

AXES = ("lamp", "turn", "pitch")


@dataclass(frozen=True, eq=False)
class Counted:
    """What the counts of N points say at W wavelengths, as standard uncertainties; 0 where nothing.

    Attributes
    ----------
    counting : (N, W) float64
        Counting and reading of the points themselves, 1/sr.
    dark : (N, W) float64
        Of their dark spectra, 1/sr.
    incident : (N, W) float64
        Of the direct beam or the panel, darks included, as a fraction of the BRDF.
    stray : (N, W) float64
        Stray light, 1/sr.
    """

    counting: Array
    dark: Array
    incident: Array
    stray: Array

    @classmethod
    def empty(cls, shape: tuple[int, int]) -> Counted:
        """Return zeros, to be filled."""
        return cls(*(np.zeros(shape) for _ in range(4)))


def components_of(
    raw: RawScan, scan: Scan, rows: Rows, skipped: npt.NDArray[np.bool_], budget: Budget, counted: Counted
) -> tuple[Component, ...]:
    """Return the components of a scan whose points are rows (N,) of the raw measurement."""
    beam = Correlation("groups", groups=raw.rows["direct"][rows])
    out: list[Component] = []
    points = budget.points
    if points.counting:
        dark = Correlation("groups", groups=_dark_runs(raw, rows))
        out += [
            Component("counting", counted.counting, False, RANDOM, SYSTEMATIC, RANDOM),
            Component("dark", counted.dark, False, dark, SYSTEMATIC, RANDOM),
            Component("counting of the reference", counted.incident, True, beam, SYSTEMATIC, RANDOM),
        ]
    if points.reference and raw.rig.reference.noise > 0.0:
        # Two readings, before and after, each the median of three; the direct beam has its own two.
        reading = raw.rig.reference.noise * np.sqrt(MEDIAN_OF_THREE / 2.0)
        out += [
            Component("lamp power at the point", reading, True, RANDOM, SYSTEMATIC, SYSTEMATIC),
            Component("lamp power at the reference", reading, True, beam, SYSTEMATIC, SYSTEMATIC),
        ]
    if points.stray_light:
        out.append(Component("stray light", counted.stray, False))
    panel = raw.rig.geometry.panel
    if panel is not None and panel.uncertainty > 0.0:
        out.append(Component("reference panel", panel.uncertainty))
    if points.angle:
        axes = np.where(skipped[:, None], 0.0, raw.rows["axes"][rows])
        for name, values, place in zip(AXES, angle_sigmas(scan, axes, points.angle), axes.T, strict=True):
            stop = Correlation("groups", groups=_stops(place))
            out.append(Component(f"position of the {name} axis", values, False, stop))
    taken = {one.name for one in out}
    out += [_of_source(source, beam, taken) for source in budget.remaining_sources()]
    return tuple(one for one in out if np.any(one.values))


def _of_source(source: ErrorSource, beam: Correlation, taken: set[str]) -> Component:
    name = source.name if source.name not in taken else f"{source.name} (budget)"
    taken.add(name)
    over = source.wavelength
    return Component(
        name,
        source.percent / 100.0,
        True,
        {"point": RANDOM, "run": beam}.get(source.kind, SYSTEMATIC),
        RANDOM if source.kind == "incident angle" else SYSTEMATIC,
        Correlation("bell", width=over) if isinstance(over, float) else Correlation(over),
    )


def _dark_runs(raw: RawScan, rows: Rows) -> npt.NDArray[np.int64]:
    """Return a number (N,) for each row, the same where all darks of its integration times are the same."""
    chain = [raw.rows["dark"][rows]]
    longer = raw.rows["rung"][rows]
    while (longer != NO_ROW).any():
        safe = np.where(longer == NO_ROW, 0, longer)
        chain.append(np.where(longer == NO_ROW, NO_ROW, raw.rows["dark"][safe]))
        longer = np.where(longer == NO_ROW, NO_ROW, raw.rows["rung"][safe])
    _, numbers = np.unique(np.stack(chain, axis=1), axis=0, return_inverse=True)
    return np.asarray(numbers.ravel(), dtype=np.int64)


def _stops(axis: Array) -> npt.NDArray[np.int64]:
    """Return a number (N,) for each stop of an axis: rows side by side that were read back at one place."""
    return np.asarray(np.append(0, np.cumsum(np.diff(axis) != 0.0)), dtype=np.int64)
