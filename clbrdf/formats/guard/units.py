"""Units and headings: what the sizes of angles and wavelengths tell."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError, advice, settled
from clbrdf.formats.guard.options import Decision, Options
from clbrdf.formats.reading import Reading
from clbrdf.geometry import ANGLES
from clbrdf.storage.units import LONGEST, SHORTEST

Array = npt.NDArray[np.float64]

DEGREE = 180.0 / np.pi
TURN = 2.0 * np.pi
SLACK = 1e-3
MARKS = np.array([0.5, 1.0, 1.5, 2.0]) * np.pi
"""Azimuths in radians that no table in degrees has."""

SMALLEST_NM = 100.0
"""Wavelengths above are in nm whatever is said; between this and 10 both units may be meant."""


def settle_angles(path: str, reading: Reading, options: Options) -> tuple[Reading, list[Decision]]:
    """Return the reading in degrees, headings of zenith and azimuth put right.

    Raises
    ------
    InputError
        Both units fit, or none; zenith and azimuth may be exchanged.
    """
    unit, why = _angle_unit(path, reading, options)
    decisions = [Decision("angle", "degrees" if unit == "deg" else "radians", why)]
    if unit == "rad":
        turned: dict[str, Any] = {name: _tidy(getattr(reading, name) * DEGREE) for name in ANGLES}
        reading = replace(reading, **turned)
    swapped, said = _swapped(path, reading, options)
    return swapped, decisions + said


def _tidy(angles: Array) -> Array:
    """Round away what the conversion from a few printed digits of radians leaves of whole degrees."""
    near = np.round(angles, 6)
    return np.where(np.abs(angles - near) < 1e-9, near, angles)


def _angle_unit(path: str, reading: Reading, options: Options) -> tuple[str, str]:
    stated = reading.stated.angle
    said = {"deg": "the file says degrees", "rad": "the file says radians", None: "the file does not say"}[
        stated
    ]
    if options.angle is not None:
        return options.angle, advice("angle", "--unit")
    if stated is not None and "angle" in reading.stated.sure:
        return stated, "the format says so"
    zenith = float(np.max(np.abs(np.concatenate([reading.theta_i, reading.theta_r]))))
    azimuths = np.abs(np.concatenate([reading.phi_i, reading.phi_r]))
    azimuth = float(azimuths.max())
    if zenith > np.pi + SLACK or azimuth > TURN + SLACK:
        if stated == "rad" and zenith <= np.pi + SLACK:
            raise InputError(
                f"{path}: zeniths look like radians and an azimuth of {azimuth:g} is none;"
                f" settle it with {settled('angle', '--unit', 'deg', 'rad')}"
            )
        largest = f"a zenith of {zenith:g}" if zenith > np.pi + SLACK else f"an azimuth of {azimuth:g}"
        return "deg", f"{said}; {largest} is no radian" if stated != "deg" else said
    if any((np.abs(azimuths - mark) < SLACK).any() for mark in MARKS) or azimuth > 1.3 * np.pi:
        shown = f"azimuths end at {azimuth:.4g} and zeniths at {zenith:.4g}"
        return "rad", said if stated == "rad" else f"{said}; {shown}"
    if stated == "rad":
        return "rad", said
    if zenith == 0.0:
        return stated or "deg", said
    raise InputError(
        f"{path}: no zenith is above {zenith:.4g}, which fits radians as well as degrees ({said});"
        f" settle it with {settled('angle', '--unit', 'deg', 'rad')}"
    )


def _swapped(path: str, reading: Reading, options: Options) -> tuple[Reading, list[Decision]]:
    if options.swap == "zeniths":
        turned = replace(
            reading,
            theta_i=reading.theta_r,
            phi_i=reading.phi_r,
            theta_r=reading.theta_i,
            phi_r=reading.phi_i,
        )
        return turned, [Decision("swap", "incident and view direction exchanged", advice("swap", "--swap"))]
    polar = options.swap == "polar"
    why = advice("swap", "--swap")
    if options.swap is None and "angle" not in reading.stated.sure:
        azimuths = len(np.unique(reading.phi_r))
        small = np.abs(reading.phi_r).max() < 90.0 and azimuths >= 3
        largest = float(np.abs(reading.theta_r).max())
        if small and largest > 180.0:
            polar, why = True, f"a view zenith of {largest:g}° cannot be, and azimuths stay below 90°"
        elif small and largest > 90.0:
            raise InputError(
                f"{path}: view zeniths reach {largest:g}° and azimuths stay below 90°: transmission, or"
                f" exchanged headings; settle it with {settled('swap', '--swap', 'none', 'polar')}"
            )
    if not polar:
        return reading, []
    out = replace(reading, theta_r=reading.phi_r, phi_r=reading.theta_r)
    if np.abs(reading.theta_i).max() >= 90.0 and np.abs(reading.phi_i).max() < 90.0:
        out = replace(out, theta_i=reading.phi_i, phi_i=reading.theta_i)
    return out, [Decision("swap", "headings of zenith and azimuth exchanged", why)]


def settle_spectrum(
    path: str, reading: Reading, options: Options
) -> tuple[Array, tuple[str, ...], list[Decision]]:
    """Return wavelengths in nm, names of bands, and what was decided.

    Raises
    ------
    InputError
        Wavelengths that fit neither nm nor µm; a wavelength given for a file that has its own.
    """
    if reading.bands:
        return _bands(path, reading, options)
    if options.wavelength is not None:
        raise InputError(
            f"{path}: has wavelengths of its own; leave {advice('wavelength', '--wavelength')} out"
        )
    stated, waves = reading.stated.length, reading.spectrum
    low, high = float(waves.min()), float(waves.max())
    said = {"nm": "the file says nm", "um": "the file says µm", None: "the file does not say"}[stated]
    if options.length is not None:
        unit, why = options.length, advice("length", "--unit")
    elif "length" in reading.stated.sure and stated is not None:
        unit, why = stated, "the format says so"
    elif stated == "um" and high < SMALLEST_NM:
        unit, why = "um", said
    elif high < SHORTEST:
        unit, why = "um", f"{said}; {low:g} to {high:g} is no light in nm"
    elif low >= SMALLEST_NM:
        unit, why = "nm", said if stated == "nm" else f"{said}; {low:g} to {high:g} are wavelengths in nm"
    else:
        raise InputError(
            f"{path}: wavelengths from {low:g} to {high:g} may be in nm or in µm; settle it with"
            f" {settled('length', '--unit', 'nm', 'um')}"
        )
    nm = waves * (1000.0 if unit == "um" else 1.0)
    if nm.min() < SHORTEST or nm.max() > LONGEST:
        raise InputError(
            f"{path}: {nm.min():g} to {nm.max():g} nm is no wavelength of light;"
            f" settle the unit with {settled('length', '--unit', 'nm', 'um')}"
        )
    return nm, (), [Decision("length", "nm" if unit == "nm" else "µm", why)]


def _bands(path: str, reading: Reading, options: Options) -> tuple[Array, tuple[str, ...], list[Decision]]:
    if "" in reading.bands and len(reading.bands) > 1:
        raise InputError(f"{path}: some rows name their band and some do not; name all of them")
    if options.wavelength is None and reading.bands == ("",):
        raise InputError(
            f"{path}: names no wavelength; name its column like wavelength_nm, or give the one of all values"
            f" with {advice('wavelength', '--wavelength')}, in nm"
        )
    if options.wavelength is None:
        names = ", ".join(reading.bands)
        taken = f"{len(reading.bands)} band{'s' if len(reading.bands) > 1 else ''}: {names}"
        return np.full(len(reading.bands), np.nan), reading.bands, [
            Decision("bands", taken, "no wavelengths in the file")
        ]  # fmt: skip
    if len(reading.bands) > 1:
        raise InputError(
            f"{path}: has the bands {', '.join(reading.bands)}; {advice('wavelength', '--wavelength')}"
            " is for files of one"
        )
    if not SHORTEST <= options.wavelength <= LONGEST:
        raise InputError(
            f"{advice('wavelength', '--wavelength')} {options.wavelength:g} nm is no wavelength of light"
        )
    return np.array([options.wavelength]), (), [
        Decision("length", f"{options.wavelength:g} nm", advice("wavelength", "--wavelength"))
    ]  # fmt: skip
