"""A reference panel with a BRDF table of its own, in place of the direct beam.

Equation (2) needs the incident power. A panel of known BRDF f gives it from its own signal at one pose,

    P_i = P_panel / (f Ω cosθr),

so that the solid angle cancels in the sample's BRDF, and its uncertainty is the panel's.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import numpy.typing as npt
from pydantic import Field, model_validator

from clbrdf.errors import InputError
from clbrdf.formats.sheet import open_sheet
from clbrdf.formats.text import read_text
from clbrdf.geometry import cos_deg
from clbrdf.rig.kinematics import forward
from clbrdf.storage.tomlfile import TomlTable

Array = npt.NDArray[np.float64]

COLUMNS = ("theta_i", "theta_r", "phi", "wavelength", "brdf")


class PanelTable(TomlTable):
    """BRDF of a panel: one value for each direction and wavelength.

    Attributes
    ----------
    directions : (K, 3) numbers
        θi, θr, φ, degrees.
    wavelength : (W,) numbers
        Increasing, nm.
    brdf : (K, W) numbers
        1/sr.
    """

    directions: tuple[tuple[float, float, float], ...]
    wavelength: tuple[float, ...]
    brdf: tuple[tuple[float, ...], ...]


class PanelSettings(TomlTable):
    """The panel, where the rig uses one.

    Attributes
    ----------
    file : str
        CSV with the columns theta_i, theta_r, phi (degrees), wavelength (nm), brdf (1/sr).
    theta_i, theta_r, phi : float
        At which it is measured, degrees.
    between : "nearest" or "linear"
        The value at this geometry: that of the nearest direction of the table, or the mean of the
        nearest three weighted by inverse distance.
    uncertainty : float
        Relative standard uncertainty of the table; shifts all points alike.
    """

    file: str
    theta_i: Annotated[float, Field(ge=0.0, lt=90.0)] = 0.0
    theta_r: Annotated[float, Field(ge=0.0, lt=90.0)] = 45.0
    phi: Annotated[float, Field(ge=-360.0, le=360.0)] = 180.0
    between: Literal["nearest", "linear"] = "nearest"
    uncertainty: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.01
    table: PanelTable | None = None

    @model_validator(mode="after")
    def _check(self) -> PanelSettings:
        if self.theta_i == self.theta_r and self.phi % 360.0 == 0.0:
            raise ValueError("theta_i, theta_r and phi put the lamp in front of the detector")
        return self


def load_panel(path: Path) -> PanelTable:
    """Read a panel's table.

    Raises
    ------
    InputError
        No such file, a column missing, a value that is no number or not positive, or a direction that
        lacks a wavelength.
    """
    sheet = open_sheet(path, read_text(path), lambda cells: set(COLUMNS) <= set(cells))
    missing = [name for name in COLUMNS if name not in sheet.names]
    if missing:
        raise InputError(f"{path}: no column {missing[0]}; the columns are {', '.join(COLUMNS)}")
    rows = [
        row
        for block in sheet.blocks()
        for row in zip(
            block.lines, *(sheet.numbers(block, sheet.names.index(n)) for n in COLUMNS), strict=True
        )
    ]
    values: dict[tuple[float, float, float], dict[float, float]] = {}
    for place, *numbers in rows:
        theta_i, theta_r, phi, wavelength, brdf = map(float, numbers)
        if not (np.isfinite([theta_i, theta_r, phi, wavelength, brdf]).all() and brdf > 0.0):
            raise InputError(f"{path}, line {place}: brdf {brdf:g}; a panel's values are finite and above 0")
        values.setdefault((theta_i, theta_r, phi), {})[wavelength] = brdf
    wavelengths = sorted(next(iter(values.values())))
    for direction, spectrum in values.items():
        if sorted(spectrum) != wavelengths:
            raise InputError(f"{path}: direction {direction} has other wavelengths than the first one")
    return PanelTable(
        directions=tuple(values),
        wavelength=tuple(wavelengths),
        brdf=tuple(tuple(spectrum[w] for w in wavelengths) for spectrum in values.values()),
    )


def panel_share(panel: PanelSettings, axes: Array, wavelength: Array, solid_angle: float) -> Array:
    """Return f Ω cosθr (n, P) of the panel at poses (n, 3), degrees, and wavelengths (P,), nm.

    Raises
    ------
    InputError
        Wavelengths beyond the table's.
    """
    table = panel.table
    assert table is not None, "load_rig reads the table"
    known = np.array(table.wavelength)
    if wavelength[0] < known[0] - 1e-9 or wavelength[-1] > known[-1] + 1e-9:
        raise InputError(
            f"{panel.file}: the panel's table runs from {known[0]:g} to {known[-1]:g} nm, and"
            f" {wavelength[0]:.1f} to {wavelength[-1]:.1f} nm are needed"
        )
    pose = forward(axes)
    wanted = _vectors(pose.theta_i, pose.theta_r, pose.phi_r - pose.phi_i)
    stored = _vectors(*np.array(table.directions).T)
    distance = np.linalg.norm(wanted[:, None] - stored[None], axis=-1)
    count = 1 if panel.between == "nearest" else min(3, len(stored))
    nearest = np.argsort(distance, axis=1, kind="stable")[:, :count]
    weights = 1.0 / np.maximum(np.take_along_axis(distance, nearest, axis=1), 1e-9)
    weights /= weights.sum(axis=1, keepdims=True)
    spectra = np.array([np.interp(wavelength, known, row) for row in table.brdf])
    values = np.einsum("nk,nkp->np", weights, spectra[nearest])
    return np.asarray(values * solid_angle * cos_deg(pose.theta_r)[:, None])


def _vectors(theta_i: Array, theta_r: Array, phi: Array) -> Array:
    """Points (n, 4) whose distance is about that of two geometries; φ and −φ are one."""
    ti, tr, p = (np.deg2rad(np.asarray(angle, dtype=np.float64)) for angle in (theta_i, theta_r, phi))
    return np.stack([ti, tr, np.sin(ti) * np.sin(tr) * np.cos(p), np.sin(tr) * np.abs(np.sin(p))], axis=-1)
