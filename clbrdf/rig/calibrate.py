"""Raw counts to an absolute BRDF by equation (2), with its uncertainty.

    BRDF = P_s / (P_i Ω cosθr)                                                (2)

P_s and P_i are signals of the same spectrometer, counts per second, darks subtracted and divided by the
nonlinearity polynomial: P_i with the lamp straight into the detector, so that lamp spectrum and
responsivity cancel. P_i is carried to the moment of P_s by the ratio of the reference powers. Values
are formed for each pixel and averaged over the bins of a regular grid, each pixel weighted by the part
of it that lies in the bin.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clbrdf import __version__
from clbrdf.errors import InputError
from clbrdf.geometry import cos_deg
from clbrdf.rig.budget import Budget
from clbrdf.rig.components import Counted, components_of
from clbrdf.rig.exposure import saturation_limit
from clbrdf.rig.kinematics import forward
from clbrdf.rig.panel import panel_share
from clbrdf.rig.planfile import WavelengthGrid
from clbrdf.rig.rawscan import RawScan, write_raw
from clbrdf.rig.row import DISAGREE, NO_ROW, PANEL, ROW_FLAGS, SKIPPED
from clbrdf.rig.uncertainty import count_variance, linearised
from clbrdf.scan import Scan
from clbrdf.scan.component import root_sum
from clbrdf.scan.flags import FLAGS, for_other_reasons
from clbrdf.storage import hdf5

Array = npt.NDArray[np.float64]

BLOCK_ROWS = 512
"""Points calibrated at a time: bounds the memory."""

NOT_MEASURED = np.uint32(1 << FLAGS.index("not_measured"))
LIMIT = np.uint32(1 << len(FLAGS) + ROW_FLAGS.index("limit_switch"))
SATURATED_VALUE = np.uint32(1 << len(FLAGS) + ROW_FLAGS.index("saturated"))
DISAGREE_VALUE = np.uint32(1 << len(FLAGS) + ROW_FLAGS.index("rungs_disagree"))


def calibrate(raw: RawScan, budget: Budget) -> Scan:
    """Return the absolute scan of a raw measurement, with the components of its uncertainty.

    Raises
    ------
    InputError
        Points are missing, or the plan's wavelengths lie outside the spectrometer's.
    """
    rows = raw.point_rows()
    grid, weights = grid_and_weights(raw.wavelength, raw.plan.wavelength, raw.is_discrete)
    skipped = (raw.rows["flags"][rows] & SKIPPED) != 0
    theta_i, phi_i, theta_r, phi_r = _angles(raw, rows, skipped)
    shape = (len(rows), len(grid))
    brdf, flags = np.full(shape, np.nan), np.zeros(shape, np.uint32)
    counted = Counted.empty(shape)
    for first in range(0, len(rows), BLOCK_ROWS):
        block = slice(first, first + BLOCK_ROWS)
        good = np.nonzero(~skipped[block])[0] + first
        if len(good):
            _fill(raw, rows[good], cos_deg(theta_r[good]), weights, good, budget, brdf, flags, counted)
    flags[skipped] |= NOT_MEASURED | LIMIT
    flags[(raw.rows["flags"][rows] & DISAGREE) != 0] |= DISAGREE_VALUE
    scan = Scan(
        theta_i,
        phi_i,
        theta_r,
        phi_r,
        grid,
        brdf,
        flags=flags,
        flag_names=(*FLAGS, *ROW_FLAGS),
        sample=raw.plan.sample,
        instrument=raw.rig.name,
        provenance={**raw.provenance, "calibrated_by": f"clbrdf {__version__}"},
    )
    components = components_of(raw, scan, rows, skipped, budget, counted)
    assert scan.flags is not None
    # A value below zero has an uncertainty like any other; with it, it may be a dark surface's.
    without = for_other_reasons(scan.flags)
    total = root_sum(components, np.where(without, 0.0, scan.brdf))
    total[without] = np.nan
    return replace(scan, sigma=total, components=components)


def grid_and_weights(wavelength: Array, grid: WavelengthGrid, is_discrete: bool) -> tuple[Array, Array]:
    """Return the wavelengths of the result (W,), nm, and the weights (W, P) of the pixels in them.

    A detector of single wavelengths gives those within the plan's range, as they are.

    Raises
    ------
    InputError
        As `resampling`, or no wavelength lies within the plan's range.
    """
    if not is_discrete:
        wanted = wavelengths_of(grid)
        return wanted, resampling(wavelength, wanted, grid.step)
    inside = (wavelength >= grid.start) & (wavelength <= grid.stop)
    if not inside.any():
        raise InputError(
            f"the detector's wavelengths ({', '.join(f'{w:g}' for w in wavelength)} nm) lie outside the"
            f" plan's {grid.start:g} to {grid.stop:g} nm"
        )
    return wavelength[inside], np.eye(len(wavelength))[inside]


def wavelengths_of(grid: WavelengthGrid) -> Array:
    """Wavelengths of the regular grid, nm."""
    count = int(np.floor((grid.stop - grid.start) / grid.step + 1e-9)) + 1
    return np.asarray(grid.start + grid.step * np.arange(count))


def resampling(wavelength: Array, grid: Array, step: float) -> Array:
    """(W, P) weights, each row of sum 1: the overlap of every pixel with every bin of the grid.

    A pixel reaches half-way to its neighbours, a bin half a step to both sides. The mean over a bin
    differs from the value at its centre by step²/24 times the second derivative.

    Raises
    ------
    InputError
        A bin reaches beyond the pixels.
    """
    if (np.diff(wavelength) <= 0.0).any():
        raise InputError("the spectrometer's wavelength polynomial does not increase; read its coefficients")
    middle = (wavelength[1:] + wavelength[:-1]) / 2.0
    first, last = 2.0 * wavelength[0] - middle[0], 2.0 * wavelength[-1] - middle[-1]
    edges = np.concatenate([[first], middle, [last]])
    low, high = grid - step / 2.0, grid + step / 2.0
    if low[0] < edges[0] or high[-1] > edges[-1]:
        raise InputError(
            f"wavelengths {grid[0]:g} to {grid[-1]:g} nm in steps of {step:g} nm need a spectrum from"
            f" {low[0]:g} to {high[-1]:g} nm; the spectrometer gives {edges[0]:.1f} to {edges[-1]:.1f} nm"
        )
    overlap = np.minimum(high[:, None], edges[None, 1:]) - np.maximum(low[:, None], edges[None, :-1])
    weights = np.maximum(overlap, 0.0)
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def resample(values: npt.NDArray[np.generic], weights: Array) -> Array:
    """Return the weighted sums (n, W) over the pixels of values (n, P).

    Row by row, without BLAS: its sums depend in the last bit on how many rows there are, and a scan that
    was interrupted has to equal one that was not.
    """
    out = np.empty((len(values), len(weights)))
    for place, row in enumerate(weights):
        used = np.nonzero(row)[0]
        part = slice(int(used[0]), int(used[-1]) + 1)
        out[:, place] = np.sum(values[:, part] * row[part], axis=1)
    return out


def _angles(raw: RawScan, rows: npt.NDArray[np.intp], skipped: npt.NDArray[np.bool_]) -> list[Array]:
    """θi, φi, θr, φr from the axes read back; of skipped points as planned."""
    axes = np.asarray(raw.rows["axes"][rows], dtype=np.float64)
    pose = forward(np.where(skipped[:, None], 0.0, axes))
    planned = raw.rows["nominal"][rows].T
    measured = (pose.theta_i, pose.phi_i, pose.theta_r, pose.phi_r)
    # The axes are read back to 0.0001°; nine decimals drop the noise of arithmetic, no more.
    return [np.where(skipped, p, np.round(m, 9)) for p, m in zip(planned, measured, strict=True)]


def _fill(
    raw: RawScan,
    rows: npt.NDArray[np.intp],
    cosine: Array,
    weights: Array,
    places: npt.NDArray[np.intp],
    budget: Budget,
    brdf: Array,
    flags: npt.NDArray[np.uint32],
    counted: Counted,
) -> None:
    """Calibrate a block of points by (2) and put values, flags and uncertainties in their places."""
    table = raw.rows
    direct = table["direct"][rows]
    signal, variance, dark_variance = _rates(raw, rows)
    unique, back = np.unique(direct, return_inverse=True)
    incident, incident_variance = (values[back] for values in incident_power(raw, unique))
    power = table["reference_power"]
    carried = (power[direct] / power[rows])[:, None]
    # A pixel without incident light says nothing about reflection there.
    blind = incident <= 0.0
    safe = np.where(blind, 1.0, incident)
    factor = carried / (safe * raw.rig.geometry.solid_angle * cosine[:, None])
    values = np.where(blind, 0.0, signal * factor)
    touched = (weights > 0.0).astype(np.float64)
    unseen = resample(blind, touched) > 0.0
    brdf[places] = np.where(unseen, np.nan, resample(values, weights))
    counted.counting[places] = np.sqrt(resample(variance * factor**2, weights**2))
    counted.dark[places] = np.sqrt(resample(dark_variance * factor**2, weights**2))
    relative = incident_variance / safe**2
    counted.incident[places] = np.sqrt(resample(relative, weights**2))
    if budget.points.stray_light:
        stray = budget.points.stray_light * signal.mean(axis=1, keepdims=True) * factor
        counted.stray[places] = np.abs(resample(stray, weights))
    full_pixels = is_full(raw, rows) | is_full(raw, direct)
    flags[places] |= np.where(resample(full_pixels, touched) > 0.0, SATURATED_VALUE, np.uint32(0))
    flags[places] |= np.where(unseen, NOT_MEASURED, np.uint32(0))


def incident_power(raw: RawScan, rows: npt.NDArray[np.intp]) -> tuple[Array, Array]:
    """Return the incident power P_i of (2), counts per second, (n, P), and its variance.

    The direct beam is it; a panel's signal is divided by what the panel sends of it to the detector.
    """
    rate, own, dark = _rates(raw, rows)
    variance = own + dark
    here = np.nonzero(raw.rows["kind"][rows] == PANEL)[0]
    if len(here):
        panel = raw.rig.geometry.panel
        assert panel is not None
        axes = np.asarray(raw.rows["axes"][rows[here]], dtype=np.float64)
        low, high = panel_window(raw)
        share = np.ones((len(here), len(raw.wavelength)))
        share[:, low:high] = panel_share(panel, axes, raw.wavelength[low:high], raw.rig.geometry.solid_angle)
        rate[here] /= share
        variance[here] /= share**2
    return rate, variance


def panel_window(raw: RawScan) -> tuple[int, int]:
    """Pixels that the plan's wavelengths use: a panel's table need not reach farther."""
    _, weights = grid_and_weights(raw.wavelength, raw.plan.wavelength, raw.is_discrete)
    used = np.nonzero(weights.sum(axis=0))[0]
    return int(used[0]), int(used[-1]) + 1


def is_full(raw: RawScan, rows: npt.NDArray[np.intp]) -> npt.NDArray[np.bool_]:
    """Say which pixels (n, P) of rows were saturated in at least one scan."""
    limit = saturation_limit(raw.full_scale, raw.rig.spectrometer)
    scans = raw.rows["scans"][rows].astype(np.uint64)[:, None]
    return np.asarray(raw.rows["counts"][rows] >= limit * scans)


def _rates(raw: RawScan, rows: npt.NDArray[np.intp]) -> tuple[Array, Array, Array]:
    """Linear net counts per second (n, P) of rows, their variance from counting and reading, and the darks'.

    Where a row has longer integration times besides, each pixel takes the longest that is not saturated.
    """
    found = _own_rates(raw, rows)
    longer = raw.rows["rung"][rows]
    while (longer != NO_ROW).any():
        here = np.nonzero(longer != NO_ROW)[0]
        there = longer[here].astype(np.intp)
        good = ~is_full(raw, there)
        for kept, own in zip(found, _own_rates(raw, there), strict=True):
            kept[here] = np.where(good, own, kept[here])
        longer = np.where(longer == NO_ROW, NO_ROW, raw.rows["rung"][longer])
    return found


def _own_rates(raw: RawScan, rows: npt.NDArray[np.intp]) -> tuple[Array, Array, Array]:
    """As `_rates`, of the rows' own integration times."""
    table, detector = raw.rows, raw.rig.spectrometer
    scans, dark_scans = (table["scans"][r].astype(np.float64)[:, None] for r in (rows, table["dark"][rows]))
    counts = table["counts"][rows] / scans
    dark = table["counts"][table["dark"][rows]] / dark_scans
    seconds = table["integration_time"][rows][:, None]
    linear, slope = linearised(counts - dark, raw.nonlinearity)
    carried = (slope / seconds) ** 2
    own, of_dark = count_variance(counts, detector) / scans, count_variance(dark, detector) / dark_scans
    return linear / seconds, own * carried, of_dark * carried


def save_calibrated(path: Path | str, raw: RawScan, scan: Scan, budget: Budget, overwrite: bool) -> None:
    """Write a calibrated scan, the budget, and the raw counts.

    Raises
    ------
    InputError
        The file exists and may not be replaced, or cannot be written.
    """
    with hdf5.create_file(path, "scan", f"BRDF of {scan.sample or 'a sample'}", overwrite) as file:
        entry = file["entry"]
        scan.write(entry)
        group = hdf5.group(entry, "uncertainty", "NXcollection")
        group["budget"] = budget.model_dump_json()
        write_raw(entry, raw)
