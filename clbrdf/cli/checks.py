"""Energy and reciprocity of a surface, printed."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clbrdf.cli.console import number, print_table, stdout_console
from clbrdf.fit.result import Fit
from clbrdf.geometry import Directions
from clbrdf.scene.checks import (
    Brdf,
    Exchange,
    Reflectance,
    cut_words,
    energy_words,
    measured_exchange,
    reciprocity_words,
    reflectance_of,
    worst_exchange,
)
from clbrdf.scene.surface import ScanSurface, Surface

Array = npt.NDArray[np.float64]

DIGITS = 6
MOST_ANGLES = 8
"""Incident zeniths, the first of them."""


def print_surface_checks(surface: Surface, theta_i: Array, wavelength: Array) -> None:
    """Print directional-hemispherical reflectance and reciprocity of a scene's surface."""

    def brdf(directions: Directions) -> Array:
        return surface.values(directions, wavelength)

    if not isinstance(surface, ScanSurface):
        print_checks(brdf, theta_i, wavelength, surface.diverges(wavelength))
        return
    scan = surface.scan
    if np.isin(scan.phi, (0.0, 180.0)).all():
        say("reflectance: measured in one plane only; the integral over the hemisphere is not known")
    else:
        reflectance = reflectance_of(brdf, theta_i, False)
        _print_reflectance(reflectance, wavelength)
        say("of the nearest measured direction each")
    exchange = measured_exchange(scan)
    if exchange is None:
        say("reciprocity: no direction was measured both ways; not known")
    else:
        say(reciprocity_words(exchange))


MOST_WAVELENGTHS = 25
"""Of a fit, spread over all of it: enough to see, and quick without a device."""


def print_fit_checks(fit: Fit) -> None:
    """Print directional-hemispherical reflectance and reciprocity of a fit, in NumPy."""
    good = np.nonzero(np.isfinite(fit.vector).all(axis=1))[0]
    if not good.size:
        say("reflectance: no wavelength has parameters; not known")
        return
    shown = good[np.unique(np.linspace(0, len(good) - 1, MOST_WAVELENGTHS).round().astype(np.intp))]
    parameters = fit.vector[shown][:, None, :]

    def brdf(directions: Directions) -> Array:
        return fit.model.brdf(parameters, fit.model.features(directions)).T

    where = f", at {len(shown)} of {len(fit.wavelength)} wavelengths"
    where = where if len(shown) < len(fit.wavelength) else ""
    print_checks(
        brdf,
        fit.scan.incident_angles[:MOST_ANGLES],
        fit.wavelength[shown],
        fit.model.diverges(parameters),
        where,
    )


def print_checks(brdf: Brdf, theta_i: Array, wavelength: Array, diverges: bool, where: str = "") -> None:
    """Print directional-hemispherical reflectance and reciprocity of a BRDF, directions (N) -> (N, W)."""
    reflectance = reflectance_of(brdf, theta_i, diverges)
    exchange: Exchange = worst_exchange(brdf, wavelength)
    _print_reflectance(reflectance, wavelength, where)
    say(reciprocity_words(exchange))


def _print_reflectance(reflectance: Reflectance, wavelength: Array, where: str = "") -> None:
    values = reflectance.values
    if np.ptp(values, axis=1).max() <= 1e-12 * np.abs(values).max():
        columns = ["θi (°)", "reflectance"]
        rows = [
            [number(angle), number(row[0], DIGITS)]
            for angle, row in zip(reflectance.theta_i, values, strict=True)
        ]
    else:
        columns = ["θi (°)", "least", "at (nm)", "most", "at (nm)"]
        rows = []
        for angle, row in zip(reflectance.theta_i, values, strict=True):
            low, high = int(np.argmin(row)), int(np.argmax(row))
            ends = [number(row[low], DIGITS), number(wavelength[low])]
            ends += [number(row[high], DIGITS), number(wavelength[high])]
            rows.append([number(angle), *ends])
    say(f"directional-hemispherical reflectance to θr = {reflectance.max_zenith:g}°{where}")
    print_table("", columns, rows, left=0)
    say(energy_words(reflectance, wavelength))
    say(cut_words(reflectance))


def say(line: str) -> None:
    """Print a line of words, wrapped where the terminal ends."""
    stdout_console().print(line)
