"""From a reading to a scan: each convention settled, said, and written into the provenance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError, advice, settled
from clbrdf.formats.guard import evidence
from clbrdf.formats.guard.hemisphere import Total, total_of
from clbrdf.formats.guard.options import Decision, Options
from clbrdf.formats.guard.sample import UsableSample, make_sample
from clbrdf.formats.guard.units import settle_angles, settle_spectrum
from clbrdf.formats.reading import SCALES, Reading
from clbrdf.formats.stated import stated_components
from clbrdf.formats.vectors import from_specular
from clbrdf.geometry import ANGLES
from clbrdf.scan import Scan
from clbrdf.scan.component import root_sum
from clbrdf.scan.flags import FLAGS, flag_unusable

Array = npt.NDArray[np.float64]

CLEAR_RATIO = 1.5
"""One half-plane this much brighter near the mirror directions is worth a word."""

MOST = 1.03
"""A surface reflects at most 1; the rest is for what was measured."""

TIS_TOLERANCE = 0.05


def decide(path: str, reading: Reading, options: Options | None = None) -> tuple[Scan, tuple[Decision, ...]]:
    """Return the scan that a reading makes, and how its conventions were taken.

    Parameters
    ----------
    path : str
        For messages.
    reading : Reading
    options : Options, optional
        What the user has settled.

    Raises
    ------
    InputError
        Two readings fit equally well, or the data contradict what the file says; the message names the
        option that decides. Also angles out of range.
    """
    chosen = options or Options()
    _check_finite(path, reading)
    reading, decisions = settle_angles(path, reading, chosen)
    nm, bands, said = settle_spectrum(path, reading, chosen)
    decisions += said
    reading = _signed(reading)
    origin, said = _origin(path, reading, chosen)
    reading, decisions = origin, decisions + said
    reading, lost = _in_range(path, reading)
    decisions += lost
    flags = np.zeros(reading.values.shape, np.uint32) if reading.flags is None else reading.flags
    usable = flag_unusable(reading.values, flags, reading.sigma) == 0
    sample = make_sample(
        reading.theta_i, reading.phi_i, reading.theta_r, reading.phi_r - reading.phi_i, reading.values, usable
    )
    forward, said = _forward(path, reading, sample, chosen)
    decisions += said
    divide, said = _cosine(path, reading, sample, forward, chosen)
    decisions += said
    if divide:
        sample = _divided(sample)
    factor, said = _scale(path, reading, sample, chosen)
    decisions += said
    return _scan(reading, nm, bands, forward, divide, factor, decisions), tuple(decisions)


def _check_finite(path: str, reading: Reading) -> None:
    for name in ANGLES:
        bad = ~np.isfinite(getattr(reading, name))
        if bad.any():
            place = int(np.argmax(bad))
            where = f"direction {place + 1}"
            if reading.lines is not None:
                where = f"line {reading.lines[place]:.0f}"
            raise InputError(
                f"{path}, {where}: {name} is {getattr(reading, name)[place]:g}; it has to be finite"
            )


def _signed(reading: Reading) -> Reading:
    """Give zeniths below zero to the other half-plane."""
    out = {}
    for zenith, azimuth in (("theta_i", "phi_i"), ("theta_r", "phi_r")):
        values = getattr(reading, zenith)
        if (values < 0.0).any():
            out[zenith] = np.abs(values)
            out[azimuth] = getattr(reading, azimuth) + np.where(values < 0.0, 180.0, 0.0)
    return replace(reading, **out) if out else reading


def _sample(reading: Reading) -> UsableSample:
    usable = np.isfinite(reading.values) & (reading.values > 0.0)
    inside = (reading.theta_i < 90.0) & (reading.theta_r < 90.0)
    phi = reading.phi_r - reading.phi_i
    return make_sample(
        reading.theta_i, reading.phi_i, reading.theta_r, phi, reading.values, usable & inside[:, None]
    )


def _origin(path: str, reading: Reading, options: Options) -> tuple[Reading, list[Decision]]:
    """Turn view directions that are counted from the specular one."""
    stated = reading.stated
    origin, why = stated.origin, "the format says so"
    if options.origin is not None:
        origin, why = options.origin, advice("origin", "--origin")
    elif "origin" not in stated.sure:
        found = evidence.peaks(_sample(reading))
        shifted = evidence.reach(reading.theta_i, reading.theta_r)
        if origin == "normal" and (found.at == "centre" or shifted):
            seen = found.words if found.at == "centre" else shifted
            raise InputError(
                f"{path}: {seen}, as when view angles are counted from the specular direction; settle it with"
                f" {settled('origin', '--origin', 'specular')}, or {settled('origin', '--origin', 'normal')}"
                " to take the angles as they are"
            )
    if origin == "normal":
        return reading, []
    azimuth = reading.phi_r - reading.phi_i
    theta_r, phi = from_specular(reading.theta_i, azimuth, reading.theta_r)
    turned = replace(
        reading, theta_r=theta_r, phi_r=reading.phi_i + phi, stated=replace(stated, forward=180.0)
    )
    return turned, [Decision("origin", "view angles counted from the specular direction", why)]


def _in_range(path: str, reading: Reading) -> tuple[Reading, list[Decision]]:
    """Refuse zeniths that no direction has; leave out those on the horizon."""
    for name, most in (("theta_i", 90.0), ("theta_r", 180.0)):
        values = getattr(reading, name)
        bad = ~(values <= most)
        if bad.any():
            place = int(np.argmax(bad))
            where = "" if reading.lines is None else f", line {reading.lines[place]:.0f}"
            angle = "incident" if name == "theta_i" else "view"
            raise InputError(
                f"{path}{where}: the {angle} zenith {values[place]:g}° is out of range;"
                f" it lies in [0°, {most:g}°{')' if name == 'theta_i' else ']'}"
            )
    level = (reading.theta_i >= 90.0) | (reading.theta_r == 90.0)
    if not level.any():
        return reading, []
    if level.all():
        raise InputError(f"{path}: all {len(level)} directions lie on the horizon (90°)")
    count = int(level.sum())
    said = Decision("check", f"{count} directions left out", "on the horizon, where a BRDF has no meaning")
    return reading.rows(~level), [said]


def _forward(
    path: str, reading: Reading, sample: UsableSample, options: Options
) -> tuple[float, list[Decision]]:
    """Return φr − φi of the forward half-plane in the file."""
    stated = reading.stated
    found = evidence.peaks(sample)
    turn = advice("forward", "--phi-forward")
    if options.forward is not None:
        return options.forward, [
            Decision("forward", f"forward is φ = {options.forward:g}°", f"{turn}; {found.words}")
        ]
    seen = float(found.at) if found.at in ("0", "180") else None
    if stated.forward is None:
        if seen is None:
            raise InputError(
                f"{path}: nothing says whether φ = 0 or 180 is forward, and {found.words};"
                f" settle it with {settled('forward', '--phi-forward', 0, 180)}"
            )
        return seen, [Decision("forward", f"forward is φ = {seen:g}° in this file", found.words)]
    if "forward" in stated.sure:
        why = "the format says so"
    else:
        why = "as such files have it"
        if seen is not None and seen != stated.forward:
            raise InputError(
                f"{path}: {found.words}, and forward should be φ = {stated.forward:g}°; settle it with"
                f" {settled('forward', '--phi-forward', int(seen))}, or"
                f" {settled('forward', '--phi-forward', int(stated.forward))} for a surface that"
                " reflects back"
            )
    decisions = [Decision("forward", f"forward is φ = {stated.forward:g}°", f"{why}; {found.words}")]
    brighter = found.ratio if stated.forward == 180.0 else 1.0 / found.ratio
    if brighter < 1.0 / CLEAR_RATIO and (seen is None or seen != stated.forward):
        decisions.append(
            Decision("check", f"{1.0 / brighter:.2g} times brighter towards the source", f"{turn} turns it")
        )
    return stated.forward, decisions


def _cosine(
    path: str, reading: Reading, sample: UsableSample, forward: float, options: Options
) -> tuple[bool, list[Decision]]:
    """Return whether values have to be divided by cosθr."""
    stated = reading.stated

    def words(included: bool) -> str:
        return "values are divided by cosθr" if included else "values are without cosine"

    if options.cosine is not None:
        return options.cosine, [Decision("cosine", words(options.cosine), advice("cosine", "--cosine"))]
    found = evidence.cosine(sample, forward)
    decisions = []
    if np.isfinite(found.spread) and found.spread > 0.3:
        decisions.append(Decision("check", "not reciprocal", found.words))
    if stated.cosine is None:
        if found.included is None:
            raise InputError(
                f"{path}: nothing says whether values include cosθr, and {found.words};"
                f" settle it with {_cosine_option(True)} or {_cosine_option(False)}"
            )
        return found.included, [Decision("cosine", words(found.included), found.words), *decisions]
    why = "the format says so" if "cosine" in stated.sure else "the file says so"
    if found.included is not None and found.included != stated.cosine and "cosine" not in stated.sure:
        should = "with" if stated.cosine else "without"
        raise InputError(
            f"{path}: {found.words}, and values should be {should} cosine; settle it with"
            f" {_cosine_option(found.included)}, or {_cosine_option(stated.cosine)}"
            " to take the file at its word"
        )
    return stated.cosine, [Decision("cosine", words(stated.cosine), f"{why}; {found.words}"), *decisions]


def _divided(sample: UsableSample) -> UsableSample:
    inverse = 1.0 / np.cos(np.deg2rad(sample.theta_r))
    return replace(sample, shape=sample.shape * inverse, bright=sample.bright * inverse)


def _scale(
    path: str, reading: Reading, sample: UsableSample, options: Options
) -> tuple[float, list[Decision]]:
    """Return what values are multiplied by, and how much the surface reflects then."""
    stated = reading.stated
    totals = [total for group in sample.groups() if (total := total_of(group)) is not None]
    low = max((total.low for total in totals), default=0.0)
    if options.scale is not None:
        factor = SCALES[options.scale]
        return factor, [
            Decision("scale", _words(options.scale), advice("scale", "--scale")),
            *([_too_much(low * factor, "doubt the scale")] if low * factor > MOST else []),
            *_totals(reading, totals, factor),
        ]
    fits = [name for name in ("1", "pi", "percent", "pi-percent") if low * SCALES[name] <= MOST]
    seen = (
        f"as they are, values reflect {low:.3g} or more" if totals else "no hemisphere to tell the scale by"
    )
    ask = settled("scale", "--scale", *fits[:3])
    if stated.scale is None and len(sample.theta_i) == 0:
        return 1.0, [Decision("scale", _words("1"), "no value in the file can be used")]
    if stated.scale is None:
        # Of readings that fit, the data cannot choose: a darker surface is always possible.
        raise InputError(f"{path}: nothing says what scale values have ({seen}); settle it with {ask}")
    factor = SCALES[stated.scale]
    if low * factor > MOST:
        if "scale" not in stated.sure:
            raise InputError(
                f"{path}: if {_words(stated.scale)}, they reflect {low * factor:.3g} times what comes in;"
                f" settle it with {ask}, or {settled('scale', '--scale', stated.scale)}"
                " to take the file at its word"
            )
        decisions = [_too_much(low * factor, "doubt the file")]
    else:
        decisions = []
    why = "the format says so" if "scale" in stated.sure else "the file says so"
    return factor, [
        Decision("scale", _words(stated.scale), why),
        *decisions,
        *_totals(reading, totals, factor),
    ]


def _too_much(reflected: float, advised: str) -> Decision:
    return Decision("check", f"reflects {reflected:.3g} or more", f"more than comes in: {advised}")


def _words(scale: str) -> str:
    names = {"1": "f in 1/sr", "pi": "π f", "percent": "100 f", "pi-percent": "100 π f"}
    return f"values are {names[scale]}"


def _totals(reading: Reading, totals: list[Total], factor: float) -> list[Decision]:
    """Say how much is reflected, and whether the file's own totals agree."""
    if not totals:
        return []
    few = totals if len(totals) <= 3 else [totals[0], totals[len(totals) // 2], totals[-1]]
    shown = "; ".join(
        f"{total.low * factor:.3g} or more at {total.theta_i:.0f}°"
        if total.planar
        else f"{total.mean * factor:.3g} at {total.theta_i:.0f}° ({100 * total.coverage:.0f} % seen)"
        for total in few
    )
    how = (
        "the plane of incidence turned about the normal" if few[0].planar else "integral of what was measured"
    )
    out = [Decision("check", f"reflects {shown}", how)]
    ratios = []
    for total in totals:
        if total.planar:
            continue
        nearest = min(reading.tis, key=lambda angle: abs(angle - total.theta_i), default=None)
        if nearest is not None and abs(nearest - total.theta_i) < 0.1 and total.mean > 0.0:
            ratios.append(reading.tis[nearest] / (total.mean * factor))
    if ratios:
        middle = float(np.median(ratios))
        agree = abs(middle - 1.0) <= TIS_TOLERANCE
        out.append(
            Decision(
                "check", f"TIS of the file is {middle:.2f} of the integral", "agrees" if agree else "not used"
            )
        )
    return out


def _scan(
    reading: Reading,
    nm: Array,
    bands: tuple[str, ...],
    forward: float,
    divide: bool,
    factor: float,
    decisions: list[Decision],
) -> Scan:
    """Return the scan; arrays that nothing changes are handed over as they are."""
    values, sigma, common = reading.values, reading.sigma, reading.common
    if factor != 1.0 or divide:
        scale = np.full((len(values), 1), factor)
        if divide:
            scale /= np.abs(np.cos(np.deg2rad(reading.theta_r)))[:, None]
        values = values * scale
        sigma = None if sigma is None else sigma * scale
        common = None if common is None else common * scale
    phi_r = reading.phi_r if forward == 180.0 else reading.phi_r + (180.0 - forward)
    flags = reading.flags
    if flags is None and np.isnan(values).any():
        flags = np.where(np.isnan(values), np.uint32(1 << FLAGS.index("not_measured")), np.uint32(0))
    columns: slice | npt.NDArray[np.intp] = slice(None)
    if not bands and (np.diff(nm) < 0.0).any():
        columns = np.argsort(nm)
    provenance = dict(reading.provenance)
    for k, note in enumerate(reading.notes, 1):
        provenance[f"read_{k}"] = note
    for k, decision in enumerate(decisions, 1):
        provenance[f"guard_{k}_{decision.name}"] = str(decision)
    if common is not None:
        common = common[:, columns]
    brdf = values[:, columns] if not isinstance(columns, slice) else values
    sigma = None if sigma is None else sigma[:, columns]
    components = stated_components(brdf, sigma, common)
    if components:
        stated = np.isfinite(brdf) if sigma is None else np.isfinite(sigma)
        sigma = np.where(stated, root_sum(components, np.nan_to_num(brdf)), np.nan)
    return Scan(
        reading.theta_i,
        reading.phi_i,
        reading.theta_r,
        phi_r,
        nm[columns],
        brdf,
        sigma=sigma,
        components=components,
        flags=None if flags is None else flags[:, columns] if not isinstance(columns, slice) else flags,
        flag_names=reading.flag_names,
        sample=reading.sample,
        instrument=reading.instrument,
        provenance=provenance,
        bands=bands,
        **reading.extra,
    )


def _cosine_option(included: bool) -> str:
    """Return how it is said that values include the cosine, or do not."""
    return advice(f"cosine={included}", f"--cosine {'included' if included else 'none'}")
