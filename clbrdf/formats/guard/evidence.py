"""What data tell about their own conventions."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.formats.guard.sample import Group, UsableSample

Array = npt.NDArray[np.float64]

IN_PLANE = 12.0
PROMINENT = 2.0
"""A peak stands out by this factor from what lies 20° and more away from it."""

STEEP = 10.0
"""Degrees of incidence below which forward and backward lie too close to tell apart."""

CLOSE = 1.0
"""Degrees within which two directions are the same for reciprocity."""

DECISIVE = 6.0
"""How much better one reading has to explain the data than the other, as a ratio of squared deviations."""


@dataclass(frozen=True)
class Peaks:
    """Where peaks in the plane of incidence lie.

    Attributes
    ----------
    at : str
        "180" or "0" for the half-plane of φ that holds the mirror direction, "centre" for the direction that
        the file counts as 0, "" where nothing stands out or the incidences disagree.
    words : str
        What was seen.
    ratio : float
        Median brightness of the half-plane φ = 180° to that of φ = 0°, near the mirror directions; NaN where
        one of them was not measured.
    """

    at: str
    words: str
    ratio: float


def peaks(sample: UsableSample) -> Peaks:
    """Look for the mirror peak in the plane of incidence."""
    votes: Counter[str] = Counter()
    seen: list[str] = []
    ratios: list[float] = []
    for group in sample.groups():
        if group.theta_i < STEEP:
            continue
        signed, values = _profile(group)
        if len(signed) < 5:
            continue
        ratios += _ratios(group.theta_i, signed, values)
        vote, where = _vote(group.theta_i, signed, values)
        if vote:
            votes[vote] += 1
            seen.append(f"{where:.0f}° for θi = {group.theta_i:.0f}°")
    ratio = float(np.exp(np.median(np.log(ratios)))) if ratios else float("nan")
    if not votes:
        return Peaks("", "no peak stands out", ratio)
    best, count = votes.most_common(1)[0]
    if count < 0.75 * votes.total():
        return Peaks("", f"peaks disagree: {', '.join(seen[:4])}", ratio)
    half = "" if best == "centre" else f" at φ = {best}°"
    return Peaks(best, f"peak{half} at θr = {', '.join(s.lstrip('-') for s in seen[:3])}", ratio)


def _profile(group: Group) -> tuple[Array, Array]:
    """Return view zeniths with + for φ near 180°, − for φ near 0°, and mean values there."""
    folded = np.minimum(group.phi, 360.0 - group.phi)
    there = (folded >= 180.0 - IN_PLANE) | (folded <= IN_PLANE) | (group.theta_r < 1.0)
    signed = np.round(np.where(folded > 90.0, 1.0, -1.0)[there] * group.theta_r[there], 2)
    places, back, counts = np.unique(signed, return_inverse=True, return_counts=True)
    return places, np.bincount(back.reshape(-1), group.shape[there], len(places)) / counts


def _vote(theta_i: float, signed: Array, values: Array) -> tuple[str, float]:
    top = int(np.argmax(values))
    where = float(signed[top])
    away = values[np.abs(signed - where) >= 20.0]
    if len(away) < 2 or not values[top] > PROMINENT * np.median(np.abs(away)):
        return "", where
    edge = top in (0, len(signed) - 1)
    gap = float(np.max(np.abs(np.diff(signed))[max(top - 1, 0) : top + 1]))
    if theta_i >= 25.0 and abs(where) <= max(0.15 * theta_i, 0.6 * gap) and not edge:
        return "centre", where
    # A rise at the end of what was measured is a peak only towards grazing, behind the mirror direction.
    if edge and abs(where) < theta_i - gap:
        return "", where
    if where > 0.4 * theta_i:
        return "180", where
    if where < -0.4 * theta_i:
        return "0", where
    return "", where


def _ratios(theta_i: float, signed: Array, values: Array) -> list[float]:
    ahead = signed > 0.0
    if ahead.sum() < 2 or (~ahead).sum() < 2:
        return []
    zenith = signed[ahead & (np.abs(signed - theta_i) <= 20.0)]
    other, there = np.abs(signed[~ahead])[::-1], values[~ahead][::-1]
    inside = zenith[(zenith >= other.min()) & (zenith <= other.max())]
    front = np.interp(inside, signed[ahead], values[ahead])
    back = np.interp(inside, other, there)
    good = (front > 0.0) & (back > 0.0)
    return list(front[good] / back[good])


def reach(theta_i: Array, theta_r: Array) -> str:
    """Say that view zeniths pass 90° and end higher the higher the incident one is, "" where they do not.

    Angles about the specular direction end at θi + 90° or before; zeniths of transmission end at 180°.
    """
    if theta_r.max() <= 90.0:
        return ""
    incidences, back = np.unique(np.round(theta_i, 1), return_inverse=True)
    ends = np.zeros(len(incidences))
    np.maximum.at(ends, back.reshape(-1), theta_r)
    if len(incidences) < 2 or len(incidences) > 200 or (ends > incidences + 90.0 + 1e-6).any():
        return ""
    slope = float(np.polyfit(incidences, ends, 1)[0])
    if slope < 0.5:
        return ""
    first, last = (f"{ends[k]:.0f}° for θi = {incidences[k]:g}°" for k in (0, -1))
    return f"view zeniths end at {first} and at {last}"


@dataclass(frozen=True)
class Cosine:
    """Whether values look as if multiplied by cosθr.

    Attributes
    ----------
    included : bool or None
        None where the data cannot tell.
    words : str
        What was seen.
    spread : float
        Median relative difference of reciprocal pairs under the better reading; NaN without pairs.
    """

    included: bool | None
    words: str
    spread: float = float("nan")


def cosine(sample: UsableSample, forward: float) -> Cosine:
    """Compare exchanged directions; where there are none, how values away from the peak fall with cosθr."""
    found = _reciprocity(sample)
    if found is not None and found.included is not None:
        return found
    flat = _flatness(sample, forward)
    if flat.included is None and found is not None:
        return found
    return Cosine(flat.included, flat.words, float("nan") if found is None else found.spread)


def _reciprocity(sample: UsableSample) -> Cosine | None:
    """Compare f(θi → θr) with f(θr → θi): with the cosine left in, they differ by cosθr / cosθi."""
    from scipy.spatial import cKDTree

    folded = np.minimum(sample.phi, 360.0 - sample.phi)
    rows = np.flatnonzero((sample.shape > 0.0) & (np.abs(sample.theta_i - sample.theta_r) > 5.0))
    if len(rows) > 20_000:
        rows = rows[:: -(-len(rows) // 20_000)]
    if len(rows) < 4:
        return None
    here = np.stack([sample.theta_i, sample.theta_r, 0.25 * folded], axis=1)
    distance, nearest = cKDTree(here).query(here[rows][:, [1, 0, 2]])
    partner = np.asarray(nearest, dtype=np.intp)
    good = (distance <= CLOSE) & (sample.shape[partner] > 0.0)
    a, b = rows[good], partner[good]
    if len(a) < 4:
        return None
    ratio = np.log(sample.shape[a] / sample.shape[b])
    x = np.log(np.cos(np.deg2rad(sample.theta_r[a])) / np.cos(np.deg2rad(sample.theta_i[a])))
    without, included = float(np.median(ratio**2)), float(np.median((ratio - x) ** 2))
    spread = float(np.expm1(np.median(np.abs(ratio - (x if included < without else 0.0)))))
    shown = f"{100.0 * spread:.2g}" if spread < 0.995 else f"{100.0 * spread:.0f}"
    words = f"{len(a)} exchanged pairs differ by {shown} %"
    if np.median(np.abs(x)) < 0.05 or max(without, included) <= 1e-12:
        return Cosine(None, words, spread)
    if without * DECISIVE < included:
        return Cosine(False, words, spread)
    if included * DECISIVE < without:
        return Cosine(
            True,
            f"{words} once divided by cosθr, and by {100 * np.expm1(np.sqrt(without)):.2g} % as they are",
            spread,
        )
    return Cosine(None, words, spread)


def _flatness(sample: UsableSample, forward: float) -> Cosine:
    """Look for values that fall exactly as cosθr away from the peak, or not at all."""
    slopes = []
    for group in sample.groups():
        turn = np.mod(group.phi - forward + 540.0, 360.0) - 180.0  # 0 in the forward half-plane
        cos_away = np.cos(np.deg2rad(group.theta_r)) * np.cos(np.deg2rad(group.theta_i)) + np.sin(
            np.deg2rad(group.theta_r)
        ) * np.sin(np.deg2rad(group.theta_i)) * np.cos(np.deg2rad(turn))
        there = (cos_away < np.cos(np.deg2rad(25.0))) & (group.theta_r <= 75.0) & (group.shape > 0.0)
        x = np.log(np.cos(np.deg2rad(group.theta_r[there])))
        if there.sum() < 6 or np.ptp(x) < 0.3:
            continue
        y = np.log(group.shape[there])
        centred = x - x.mean()
        slope = float(centred @ y / (centred @ centred))
        rest = float(np.std(y - y.mean() - slope * centred))
        slopes.append((slope, rest))
    if not slopes:
        return Cosine(None, "no directions to tell the cosine by")
    values, rests = np.array(slopes).T
    words = f"away from the peak values go as cosθr to the power {np.median(values):.2f}"
    if (np.abs(values - 1.0) < 0.15).all() and (rests < 0.05).all():
        return Cosine(True, words)
    if (np.abs(values) < 0.25).all():
        return Cosine(False, words)
    return Cosine(None, words)
