"""Made and measured surfaces that a page has to show well, from one direction to 10⁵."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

import clbrdf
from clbrdf import Directions, Scan
from clbrdf.models import get_model
from clbrdf.scans import sample_scan
from clbrdf.viz.page import PageSubject

COATINGS = Path(__file__).resolve().parents[3] / "shared" / "data" / "black_coatings"


def foil() -> PageSubject:
    """The yellow foil that the demo measures, every fourth wavelength."""
    scan = Scan.open(sample_scan("yellow_tin_foil")).columns(np.arange(0, 159, 4))
    return fitted("foil", scan, "wang2013")


def diffuse() -> PageSubject:
    """A white panel with a little gloss, made of eon + ggx, with 0.5 % of noise."""
    rng = np.random.default_rng(5)
    model = get_model("eon+ggx")
    directions, wavelength = hemisphere([0.0, 20.0, 40.0, 60.0]), np.arange(400.0, 751.0, 25.0)
    values = np.zeros((len(wavelength), len(model.names))) + model.defaults
    values[:, model.names.index("eon.rho")] = 0.97 - 0.1 * np.exp(-((wavelength - 400.0) ** 2) / 60.0**2)
    values[:, model.names.index("ggx.F0")] = 0.02
    values[:, model.names.index("ggx.alpha")] = 0.4
    exact = model.brdf(values[:, None, :], model.features(directions)).T
    brdf = exact * (1.0 + 0.005 * rng.standard_normal(exact.shape))
    scan = scan_of(directions, wavelength, brdf, 0.005 * exact, "white panel (made: eon + ggx)")
    return fitted("white panel", scan, "eon+ggx")


def black_coating() -> PageSubject:
    """A black anodised surface, measured over the hemisphere; the file stands beside the project."""
    from clbrdf.formats.load import load_one

    scan = load_one([COATINGS / "black_coatings_hemisphere_650nm.csv"], sample="AnoBlackEC1onAlum")
    return fitted("black coating", scan, "ggx+minnaert")


def many_wavelengths() -> PageSubject:
    """2048 wavelengths × 100 directions with a fit."""
    theta_r = np.linspace(-80.0, 80.0, 25)
    directions = Directions.relative(
        np.repeat([15.0, 30.0, 45.0, 60.0], 25),
        np.tile(np.abs(theta_r), 4),
        np.tile(np.where(theta_r < 0.0, 0.0, 180.0), 4),
    )
    wavelength = np.linspace(380.0, 1050.0, 2048)
    model = get_model("ggx+lambert")
    values = np.tile(model.defaults, (2048, 1))
    values[:, model.names.index("lambert.rho")] = 0.5 + 0.3 * np.sin(wavelength / 60.0)
    brdf = model.brdf(values[:, None, :], model.features(directions)).T
    return fitted(
        "spectra", scan_of(directions, wavelength, brdf, 0.01 * brdf, "2048 wavelengths"), "ggx+lambert"
    )


def many_directions() -> PageSubject:
    """10⁵ directions × 4 wavelengths, measured only."""
    rng = np.random.default_rng(0)
    theta_r, phi = np.rad2deg(np.arccos(rng.uniform(0.05, 1.0, 100_000))), rng.uniform(0.0, 360.0, 100_000)
    directions = Directions.relative(30.0, theta_r, phi)
    model = get_model("ggx+lambert")
    brdf = model.brdf(model.defaults[None, None], model.features(directions)).T * [0.7, 0.8, 0.9, 1.0]
    return PageSubject(
        "cloud", scan_of(directions, np.arange(450.0, 651.0, 50.0)[:4], brdf, None, "10⁵ directions")
    )


def one_direction() -> PageSubject:
    """One value."""
    return PageSubject("one", Scan([45.0], 0.0, [45.0], 180.0, [550.0], [[0.5]], sample="one direction"))


def holes() -> PageSubject:
    """The white panel with a fifth of its values lost, and one wavelength altogether."""
    whole = diffuse()
    brdf = np.array(whole.scan.brdf)
    brdf[np.random.default_rng(2).uniform(size=brdf.shape) < 0.2] = np.nan
    brdf[:, 3] = np.nan
    return fitted("holes", replace(whole.scan, brdf=brdf, flags=None, sample="NaN holes"), "eon+ggx")


def eleven_decades() -> PageSubject:
    """From 10⁻⁶ to 10⁵ 1/sr in one lobe."""
    theta_r = np.concatenate([np.arange(0.0, 80.5, 2.0), 45.0 + np.array([-0.5, -0.1, 0.1, 0.5])])
    away = np.abs(theta_r - 45.0)
    values = 10.0 ** (5.0 - 11.0 * (away / 45.0) ** 0.35)
    return PageSubject("mirror", Scan([45.0], 0.0, theta_r, 180.0, [633.0], values[:, None], sample="mirror"))


CASES: dict[str, Callable[[], PageSubject]] = {
    made.__name__: made
    for made in (
        foil,
        diffuse,
        black_coating,
        many_wavelengths,
        many_directions,
        one_direction,
        holes,
        eleven_decades,
    )
}


def hemisphere(theta_i: list[float]) -> Directions:
    """Directions every 10° of zenith and 20° of azimuth at each incident zenith."""
    incident, theta_r, phi = (
        a.ravel() for a in np.meshgrid(theta_i, np.arange(0.0, 71.0, 10.0), np.arange(0.0, 360.0, 20.0))
    )
    return Directions.relative(incident, theta_r, phi)


def scan_of(directions, wavelength, brdf, sigma, sample) -> Scan:
    """A scan of given values."""
    return Scan(
        directions.theta_i,
        directions.phi_i,
        directions.theta_r,
        directions.phi_r,
        wavelength,
        brdf,
        sigma=sigma,
        sample=sample,
    )


def fitted(name: str, scan: Scan, model: str) -> PageSubject:
    """A scan with its fit."""
    known = scan.sigma is not None and np.isfinite(scan.sigma).any()
    weights = "sigma" if known else "relative"
    return PageSubject(name, scan, clbrdf.fit(scan, model=model, weights=weights))
