"""From a fit or a scan to a material that can be evaluated in every direction."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clbrdf.colour import DEFAULT_ILLUMINANT, get_illuminant, rgb_weights
from clbrdf.errors import InputError, advice
from clbrdf.fit import Fit
from clbrdf.formats.rgl.format import scan_material
from clbrdf.formats.rgl.material import Material, Places
from clbrdf.formats.rgl.tables import BANDS, ONE_BAND
from clbrdf.geometry import Directions
from clbrdf.scan import Scan
from clbrdf.storage import hdf5

Array = npt.NDArray[np.float64]


SAME_AZIMUTH = 0.05
"""Degrees."""


@dataclass(frozen=True, eq=False)
class MaterialSource:
    """A material and what has to be said about it.

    Attributes
    ----------
    name : str
        Of the sample.
    origin : str
        "measured", or the name of the model.
    material : Material
    remarks : tuple of str
    shown : str
        What its three bands are, for a caption; "" where it has wavelengths.
    """

    name: str
    origin: str
    material: Material
    remarks: tuple[str, ...] = ()
    shown: str = ""


def open_source(path: str | Path, phi_i: float | None = None) -> MaterialSource:
    """Read a fit file, or a scan file whose scan can be interpolated, as a material.

    Parameters
    ----------
    path : str or Path
    phi_i : float, optional
        The incident azimuth of a scan that is taken, degrees; without it they are averaged.

    Raises
    ------
    InputError
        The file is missing or damaged, no wavelength is fitted, or the scan cannot be interpolated.
    """
    with hdf5.open_file(path) as file:
        is_fit = hdf5.content_of(file) == "fit"
    try:
        return fit_source(Fit.open(path)) if is_fit else scan_source(_turned(Scan.open(path), phi_i))
    except InputError as error:
        raise error if str(path) in str(error) else InputError(f"{path}: {error}") from error


def _turned(scan: Scan, phi_i: float | None) -> Scan:
    if phi_i is None:
        return scan
    away = np.abs((scan.phi_i - phi_i + 180.0) % 360.0 - 180.0)
    if away.min() > SAME_AZIMUTH:
        there = ", ".join(f"{angle:g}" for angle in np.unique(scan.phi_i)[:12])
        raise InputError(f"the scan has no incident azimuth of {phi_i:g}°; it has {there}")
    return scan.rows(np.asarray(away <= SAME_AZIMUTH))


def fit_source(fit: Fit) -> MaterialSource:
    """Return a fitted model as a material, at the wavelengths that have a fit.

    Raises
    ------
    InputError
        No wavelength has one.
    """
    vector = fit.vector
    good = np.asarray(np.isfinite(vector).all(axis=1))
    if not good.any():
        raise InputError("the fit has no wavelength with parameters; there is nothing to show")
    kept = vector[good]

    def brdf(theta_i: Array, theta_r: Array, phi: Array, bands: Places) -> Array:
        features = fit.model.features(Directions.relative(theta_i, theta_r, phi))
        return np.asarray(fit.model.brdf(kept[bands][:, None, :], features).T)

    name = fit.scan.sample or "a sample"
    description = f"{name}: {fit.model.name} fitted by clbrdf"
    remarks = (
        () if good.all() else (f"{(~good).sum()} of {len(good)} wavelengths have no fit and are left out",)
    )
    bands = fit.scan.bands
    if bands and (tuple(band.upper() for band in bands) != BANDS or not good.all()):
        raise InputError(
            f"the bands {', '.join(bands)} make no colour; R, G and B, all fitted, do; {ONE_BAND}"
        )
    material = Material(brdf, None if bands else fit.wavelength[good], description)
    return MaterialSource(name, fit.model.name, material, remarks)


def scan_source(scan: Scan) -> MaterialSource:
    """Return a measured BRDF, interpolated, as a material.

    Raises
    ------
    InputError
        It cannot be interpolated.
    """
    material, remarks = scan_material(scan)
    return MaterialSource(scan.sample or "a sample", "measured", material, remarks)


def material_at(source: MaterialSource, wavelengths: Array) -> MaterialSource:
    """Return a material at the wavelengths nearest to those given, nm.

    Raises
    ------
    InputError
        It has bands and no wavelengths.
    """
    material = source.material
    if material.wavelength is None:
        raise InputError("the material has the bands R, G, B and no wavelengths to choose from")
    nearest = np.abs(material.wavelength[None, :] - wavelengths[:, None]).argmin(axis=1)
    places = np.unique(nearest)
    return replace(source, material=_selected(material, places, material.wavelength[places]))


def in_colour(source: MaterialSource, illuminant: str = DEFAULT_ILLUMINANT) -> MaterialSource:
    """Return a material in linear sRGB as it looks under an illuminant, white being white.

    One of a single wavelength becomes grey, which a remark says.

    Raises
    ------
    InputError
        The wavelengths do not determine a colour, or the illuminant is not known.
    """
    material = source.material
    get_illuminant(illuminant)
    if material.wavelength is None:
        if illuminant.strip().upper() != DEFAULT_ILLUMINANT:
            raise InputError(f"the material has the bands R, G, B, which are for {DEFAULT_ILLUMINANT} only")
        return replace(source, shown="R, G, B")
    remarks, shown = source.remarks, illuminant.strip().upper()
    if material.bands == 1:
        shown = f"{material.wavelength[0]:g} nm in grey"
        remarks = (*remarks, f"one wavelength: {shown}")
        weights = np.ones((3, 1))
    else:
        mend = advice("take three of them with in_false_colour", "give three of them as --false-colour R,G,B")
        weights = rgb_weights(material.wavelength, illuminant, mend)
    every = material.every_band

    def brdf(theta_i: Array, theta_r: Array, phi: Array, bands: Places) -> Array:
        return np.asarray(material.brdf(theta_i, theta_r, phi, every) @ weights[bands].T)

    return replace(source, material=Material(brdf, None, material.description), remarks=remarks, shown=shown)


def in_false_colour(source: MaterialSource, wavelengths: Array) -> MaterialSource:
    """Return a material with three wavelengths, nm, as red, green and blue.

    Raises
    ------
    InputError
        Not three wavelengths, or the material has bands.
    """
    material = source.material
    if len(wavelengths) != 3:
        raise InputError(
            f"false colour takes 3 wavelengths, for red, green and blue; {len(wavelengths)} are given"
        )
    if material.wavelength is None:
        raise InputError("the material has the bands R, G, B and no wavelengths to choose from")
    places = np.abs(material.wavelength[None, :] - wavelengths[:, None]).argmin(axis=1)
    shown = ", ".join(f"{material.wavelength[k]:g}" for k in places)
    remarks = (*source.remarks, f"{shown} nm shown as red, green, blue")
    chosen = _selected(material, places, None)
    return replace(source, material=chosen, remarks=remarks, shown=f"{shown} nm as R, G, B")


def _selected(material: Material, places: Places, wavelength: Array | None) -> Material:
    inner = material.brdf

    def brdf(theta_i: Array, theta_r: Array, phi: Array, bands: Places) -> Array:
        return inner(theta_i, theta_r, phi, places[bands])

    return Material(brdf, wavelength, material.description)
