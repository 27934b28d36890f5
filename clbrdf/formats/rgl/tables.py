"""What stands in an RGL file, checked: the tables from which the BRDF is read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.formats.rgl.tensor_file import read_tensor_file, write_tensor_file
from clbrdf.geometry import read_only

Single = npt.NDArray[np.float32]

BANDS = ("R", "G", "B")
"""What the third axis of `spectra` means where a file has no wavelengths: linear sRGB."""

ONE_BAND = "a single band is given its wavelength when it is imported"
"""What to do about a band that is no colour."""

FORMAT_VERSION = (1, 0)


@dataclass(frozen=True, eq=False)
class Tables:
    """The content of an RGL file; immutable.

    With u, s the coordinates and shares of `coordinates` and `warp`, the BRDF times cosθr is
    spectra(s) · ndf(u_m) / (4 sigma(u_i)), all interpolated linearly.

    Attributes
    ----------
    description : str
    phi_i : (P,) float32
        Incident azimuths, radians, increasing. Up to two mean an isotropic material: azimuths of half
        vectors are then relative to the incident one.
    theta_i : (K,) float32
        Incident zeniths, radians, increasing.
    ndf, sigma : (A, B) float32
        Over azimuth and zenith of half vectors and of the incident direction; positive.
    vndf : (P, K, Y, X) float32
        Density that places the samples, over azimuth and zenith of half vectors.
    luminance : (P, K, N, N) float32
        Steers random sampling in a renderer; no part of the BRDF.
    spectra : (P, K, W, N, N) float32
    wavelength : (W,) float32 or None
        nm; None for the three bands of an RGB file.
    jacobian : bool
        Whether ndf and sigma are applied.

    Raises
    ------
    InputError
        Arrays whose shapes do not agree, or values that leave the BRDF undefined.
    """

    description: str
    phi_i: Single
    theta_i: Single
    ndf: Single
    sigma: Single
    vndf: Single
    luminance: Single
    spectra: Single
    wavelength: Single | None = None
    jacobian: bool = True

    def __post_init__(self) -> None:
        for name in ("phi_i", "theta_i", "ndf", "sigma", "vndf", "luminance", "spectra", "wavelength"):
            array = getattr(self, name)
            if array is not None:
                object.__setattr__(self, name, read_only(np.asarray(array, dtype=np.float32)))
        _check(self)

    @property
    def isotropic(self) -> bool:
        """Whether only the difference of azimuths counts."""
        return len(self.phi_i) <= 2

    @property
    def folds(self) -> int:
        """Into how many equal parts the turn of an anisotropic material is folded: 1, 2 or 4."""
        if self.isotropic:
            return 1
        return int(np.rint(2.0 * np.pi / float(self.phi_i[-1] - self.phi_i[0])))

    @property
    def bands(self) -> int:
        """How many wavelengths, or the three bands of an RGB file."""
        return int(self.spectra.shape[2])


def read_tables(path: str | Path) -> Tables:
    """Read an RGL file, RGB or spectral.

    Raises
    ------
    InputError
        No tensor file, a damaged one, or one that holds something else.
    """
    fields = read_tensor_file(path)
    try:
        return _from_fields(fields)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def write_tables(path: str | Path, tables: Tables, overwrite: bool = False) -> None:
    """Write an RGL file, whole or not at all.

    Raises
    ------
    InputError
        The file exists and `overwrite` is False, or it cannot be written.
    """
    write_tensor_file(path, to_fields(tables), overwrite)


def to_fields(tables: Tables) -> dict[str, npt.NDArray[Any]]:
    """Return the arrays of the file in the order of the database's own files."""
    text = np.frombuffer(tables.description.encode("utf-8") or b" ", dtype=np.uint8)
    fields: dict[str, npt.NDArray[Any]] = {
        "version": np.array(FORMAT_VERSION, dtype=np.uint32),
        "description": text,
        "phi_i": tables.phi_i,
        "theta_i": tables.theta_i,
        "sigma": tables.sigma,
        "ndf": tables.ndf,
        "vndf": tables.vndf,
        "luminance": tables.luminance,
    }
    if tables.wavelength is None:
        fields["rgb"] = tables.spectra
    else:
        fields |= {"wavelengths": tables.wavelength, "spectra": tables.spectra}
    return fields | {"jacobian": np.array([tables.jacobian], dtype=np.uint8)}


def size_of(tables: Tables) -> int:
    """Bytes of the arrays that the file will hold."""
    return sum(array.nbytes for array in to_fields(tables).values())


def _from_fields(fields: Mapping[str, npt.NDArray[Any]]) -> Tables:
    values = "spectra" if "spectra" in fields else "rgb"
    wanted = ["phi_i", "theta_i", "ndf", "sigma", "vndf", "luminance", values, "jacobian"]
    if values == "spectra":
        wanted.append("wavelengths")
    missing = [name for name in wanted if name not in fields]
    if missing:
        there = ", ".join(repr(name) for name in list(fields)[:12]) or "nothing"
        raise InputError(f"has no field {missing[0]!r}, which a material has; it holds {there}")
    for name in wanted:
        kind = np.uint8 if name == "jacobian" else np.float32
        if fields[name].dtype != kind:
            raise InputError(f"field {name!r} is of type {fields[name].dtype}, and {np.dtype(kind)} is read")
    if fields["jacobian"].size != 1:
        raise InputError(f"field 'jacobian' has {fields['jacobian'].size} values; one is read")
    text = fields.get("description", np.zeros(0, np.uint8))
    if text.dtype != np.uint8:
        raise InputError(f"field 'description' is of type {text.dtype}, and a text of uint8 is read")
    return Tables(
        description=text.tobytes().decode("utf-8", "replace").strip(),
        **{name: fields[name] for name in ("phi_i", "theta_i", "ndf", "sigma", "vndf", "luminance")},
        spectra=fields[values],
        wavelength=fields.get("wavelengths") if values == "spectra" else None,
        jacobian=bool(fields["jacobian"].ravel()[0]),
    )


def _check(tables: Tables) -> None:
    """Raise InputError, naming the field, where the BRDF is not defined."""
    dimensions = {"phi_i": 1, "theta_i": 1, "ndf": 2, "sigma": 2, "vndf": 4, "luminance": 4, "spectra": 5}
    for name, count in dimensions.items():
        array = getattr(tables, name)
        if array.ndim != count or 0 in array.shape:
            raise InputError(f"field {name!r} has the shape {array.shape}; {count} dimensions are read")
        if (name in {"ndf", "sigma"} or count >= 4) and min(array.shape[-2:]) < 2:
            raise InputError(f"field {name!r} has the shape {array.shape}; two nodes an axis are needed")
        if name != "spectra" and not np.isfinite(array).all():
            raise InputError(f"field {name!r} holds values that are not finite")
    incident = (len(tables.phi_i), len(tables.theta_i))
    for name in ("vndf", "luminance", "spectra"):
        if getattr(tables, name).shape[:2] != incident:
            raise InputError(
                f"field {name!r} has the shape {getattr(tables, name).shape},"
                f" and phi_i and theta_i have {incident[0]} and {incident[1]} values"
            )
    side = tables.spectra.shape[-1]
    if tables.spectra.shape[-2] != side or tables.luminance.shape[-2:] != (side, side):
        raise InputError(
            f"luminance {tables.luminance.shape} and spectra {tables.spectra.shape}"
            " have no square grid in common"
        )
    wavelength = tables.wavelength
    if wavelength is None and tables.bands != len(BANDS):
        raise InputError(f"field 'rgb' has {tables.bands} bands; it has to have 3")
    if wavelength is not None:
        if wavelength.shape != (tables.bands,):
            raise InputError(f"wavelengths {wavelength.shape} and {tables.bands} spectra do not agree")
        if not (np.isfinite(wavelength).all() and (wavelength > 0).all() and (np.diff(wavelength) > 0).all()):
            raise InputError("field 'wavelengths' does not increase from above 0 nm")
    for name in ("phi_i", "theta_i"):
        if (np.diff(getattr(tables, name)) <= 0.0).any():
            raise InputError(f"field {name!r} does not increase")
    if tables.theta_i[0] < 0.0 or tables.theta_i[-1] > np.pi / 2.0 + 1e-6:
        raise InputError("field 'theta_i' leaves 0 to π/2 radians")
    if not tables.isotropic and tables.folds not in (1, 2, 4):
        raise InputError(f"field 'phi_i' spans {np.rad2deg(tables.phi_i[-1] - tables.phi_i[0]):.0f}°")
    if (tables.ndf < 0.0).any() or (tables.sigma <= 0.0).any():
        raise InputError("field 'ndf' or 'sigma' holds values that are not positive")
    if (tables.vndf < 0.0).any():
        raise InputError("field 'vndf' holds negative values")
