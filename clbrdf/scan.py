"""A measured (or simulated) spectral BRDF: what goes into a fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, TypeVar

import numpy as np
import numpy.typing as npt

from clbrdf import hdf5
from clbrdf.errors import InputError
from clbrdf.geometry import Directions, broadcast_angles, check_finite, check_zenith, read_only, wrap_azimuth

if TYPE_CHECKING:
    import h5py

Array = npt.NDArray[np.float64]
T = TypeVar("T", bound=np.generic)

FLAGS = ("not_measured", "not_a_number", "infinite", "zero", "negative")
"""Reasons every scan knows, bits 0 to 4; a scan's own reasons take the bits after them."""

MOST_FLAGS = 32


ANGLES = {
    "theta_i": "incident zenith",
    "phi_i": "incident azimuth",
    "theta_r": "view zenith",
    "phi_r": "view azimuth",
}


@dataclass(frozen=True, eq=False)
class Scan:
    """BRDF of one sample in N directions at W wavelengths; immutable.

    Values that cannot be used (NaN, infinite, zero, negative) are flagged when the record is made; a
    value with any flag is masked: kept, shown, counted, and never fitted.

    Attributes
    ----------
    theta_i, phi_i, theta_r, phi_r : (N,) float64
        Incident and view zenith [0, 90) and azimuth [0, 360), degrees.
    wavelength : (W,) float64
        nm, positive, strictly increasing.
    brdf : (N, W) float64
        1/sr, without the cosine.
    sigma : (N, W) float64 or None
        Standard uncertainty of `brdf`, 1/sr; NaN where unknown; None where there is none at all.
    flags : (N, W) uint32
        Reasons for masking, bit k named by ``flag_names[k]``.
    flag_names : tuple of str
        At most 32.
    sample, instrument : str
        What was measured, and with what.
    provenance : mapping of str to str
        Who made it: program version, command, seed, hashes of inputs.

    Raises
    ------
    InputError
        Shapes that do not agree, angles or wavelengths out of range or out of order.

    Examples
    --------
    >>> scan = Scan([30.0], [0.0], [30.0], [180.0], [550.0], [[0.3]])
    >>> scan.phi
    array([180.])
    """

    theta_i: Array
    phi_i: Array
    theta_r: Array
    phi_r: Array
    wavelength: Array
    brdf: Array
    sigma: Array | None = None
    flags: npt.NDArray[np.uint32] | None = None
    flag_names: tuple[str, ...] = FLAGS
    sample: str = ""
    instrument: str = ""
    provenance: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        angles = broadcast_angles(*(getattr(self, name) for name in ANGLES))
        for name, values in zip(ANGLES, angles, strict=True):
            if name.startswith("theta"):
                check_zenith(name, values)
            else:
                check_finite(name, values)
                values = wrap_azimuth(values)
            self._set(name, values)
        self._set("wavelength", _checked_wavelength(self.wavelength))
        shape = (len(self.theta_i), len(self.wavelength))
        if 0 in shape:
            raise InputError(f"a scan of {shape[0]} directions and {shape[1]} wavelengths holds nothing")
        self._set("brdf", _matrix("brdf", self.brdf, shape, np.float64))
        if self.sigma is not None:
            sigma = _matrix("sigma", self.sigma, shape, np.float64)
            if (sigma < 0.0).any() or np.isinf(sigma).any():
                place = tuple(int(k[0]) for k in np.nonzero((sigma < 0.0) | np.isinf(sigma)))
                raise InputError(
                    f"sigma{list(place)} is {sigma[place]:g}; give a positive value, or NaN if unknown"
                )
            self._set("sigma", sigma)
        names = tuple(self.flag_names)
        if names[: len(FLAGS)] != FLAGS or len(names) > MOST_FLAGS or len(set(names)) < len(names):
            raise InputError(f"flag names are {names}; they start with {FLAGS}, differ, and are at most 32")
        object.__setattr__(self, "flag_names", names)
        given = np.zeros(shape, np.uint32) if self.flags is None else self.flags
        self._set("flags", flag_unusable(self.brdf, _matrix("flags", given, shape, np.uint32)))
        object.__setattr__(self, "provenance", MappingProxyType(dict(self.provenance)))

    def _set(self, name: str, values: npt.NDArray[np.generic]) -> None:
        object.__setattr__(self, name, read_only(values))

    @property
    def phi(self) -> Array:
        """φ = φr − φi, (N,), degrees, [0, 360)."""
        return wrap_azimuth(self.phi_r - self.phi_i)

    @property
    def mask(self) -> npt.NDArray[np.bool_]:
        """(N, W), True where a value is masked: flagged for any reason, not to be fitted."""
        assert self.flags is not None
        return np.not_equal(self.flags, 0)

    @property
    def directions(self) -> Directions:
        """The N directions as one record."""
        return Directions(self.theta_i, self.theta_r, self.phi)

    @property
    def incident_angles(self) -> Array:
        """The distinct incident zeniths, increasing, degrees."""
        return np.unique(self.theta_i)

    def flag_counts(self) -> dict[str, int]:
        """How many values carry each reason, those that occur."""
        assert self.flags is not None
        counts = {
            name: int(np.count_nonzero(self.flags & np.uint32(1 << k)))
            for k, name in enumerate(self.flag_names)
        }
        return {name: count for name, count in counts.items() if count}

    def at(self, wavelengths: npt.ArrayLike) -> Scan:
        """Return the scan at the measured wavelengths nearest to those given, nm."""
        wanted = np.atleast_1d(np.asarray(wavelengths, dtype=np.float64))
        nearest = np.abs(self.wavelength[None, :] - wanted[:, None]).argmin(axis=1)
        return self.columns(np.unique(nearest))

    def columns(self, index: Sequence[int] | slice | npt.NDArray[np.intp]) -> Scan:
        """Return the scan at some of its wavelengths, by their places."""
        assert self.flags is not None
        return replace(
            self,
            wavelength=self.wavelength[index],
            brdf=self.brdf[:, index],
            sigma=None if self.sigma is None else self.sigma[:, index],
            flags=self.flags[:, index],
        )

    def repeated_directions(self) -> int:
        """How many directions repeat an earlier one exactly (drift checks, repeats)."""
        rows = np.stack([self.theta_i, self.theta_r, self.phi], axis=1)
        return len(rows) - len(np.unique(rows, axis=0))

    def save(self, path: str | Path, overwrite: bool = False) -> None:
        """Write the scan as a NeXus HDF5 file, whole or not at all.

        Raises
        ------
        InputError
            The file exists and `overwrite` is False, or it cannot be written.
        """
        with hdf5.create_file(path, "scan", f"BRDF of {self.sample or 'a sample'}", overwrite) as file:
            self.write(file["entry"])

    @classmethod
    def open(cls, path: str | Path) -> Scan:
        """Read a scan file; of a fit file, the scan that was fitted.

        Raises
        ------
        InputError
            The file is missing, damaged, of a newer version, or holds neither.
        """
        with hdf5.open_file(path) as file:
            if hdf5.content_of(file) != "fit":
                hdf5.check_content(file, "scan")
            try:
                return cls.read(file["entry"])
            except InputError as error:
                raise InputError(f"{path}: {error}") from error

    def write(self, entry: h5py.Group) -> None:
        """Write the scan into an NXentry that follows NXoptical_spectroscopy where it fits."""
        angles = {name: getattr(self, name) for name in ANGLES}
        data = write_frame(entry, angles, self.wavelength, self.sample, self.instrument)
        hdf5.field(data, "brdf", self.brdf, "1/sr", "BRDF (1/sr)")
        if self.sigma is not None:
            hdf5.field(data, "brdf_errors", self.sigma, "1/sr", "standard uncertainty of the BRDF")
        assert self.flags is not None
        flags = hdf5.field(data, "flags", self.flags, "", "reasons for masking, as bits")
        flags.attrs["names"] = list(self.flag_names)
        hdf5.write_mapping(entry, "provenance", self.provenance)

    @classmethod
    def read(cls, entry: h5py.Group) -> Scan:
        """Read what `write` wrote."""
        data = entry["data"]
        return cls(
            **{name: data[name][()] for name in (*ANGLES, "wavelength", "brdf")},
            sigma=data["brdf_errors"][()] if "brdf_errors" in data else None,
            flags=data["flags"][()],
            flag_names=tuple(str(name) for name in data["flags"].attrs["names"]),
            sample=hdf5.read_text(entry["sample"], "name"),
            instrument=hdf5.read_text(entry["instrument"], "name"),
            provenance=hdf5.read_mapping(entry, "provenance"),
        )


def write_frame(
    entry: h5py.Group, angles: Mapping[str, Array], wavelength: Array, sample_name: str, instrument_name: str
) -> h5py.Group:
    """Write what a scan says beside its values into an NXentry; return the NXdata that takes the values.

    `angles` holds theta_i, phi_i, theta_r, phi_r, each (N,), degrees.
    """
    entry["definition"] = "NXoptical_spectroscopy"
    entry["experiment_type"] = "reflection spectroscopy"
    entry["experiment_sub_type"] = "bidirectional reflectance distribution function"
    sample = hdf5.group(entry, "sample", "NXsample")
    sample["name"] = sample_name
    instrument = hdf5.group(entry, "instrument", "NXinstrument")
    instrument["name"] = instrument_name
    instrument["angle_reference_frame"] = "sample-normal centered"
    data = hdf5.group(entry, "data", "NXdata")
    data.attrs["signal"] = "brdf"
    data.attrs["axes"] = [".", "wavelength"]
    for name in ANGLES:
        data.attrs[f"{name}_indices"] = 0
    data.attrs["wavelength_indices"] = 1
    for name, meaning in ANGLES.items():
        hdf5.field(data, name, angles[name], "deg", meaning)
    hdf5.field(data, "wavelength", wavelength, "nm", "wavelength")
    return data


def flag_unusable(brdf: Array, flags: npt.NDArray[np.uint32]) -> npt.NDArray[np.uint32]:
    """Return the flags with the bits for NaN, infinite, zero and negative values set.

    A NaN that is flagged as not measured is no surprise and gets no second reason.
    """
    out = flags.copy()
    missing = (out & np.uint32(1)) != 0
    for name, bad in (
        ("not_a_number", np.isnan(brdf) & ~missing),
        ("infinite", np.isinf(brdf)),
        ("zero", brdf == 0.0),
        ("negative", np.isfinite(brdf) & (brdf < 0.0)),
    ):
        out[bad] |= np.uint32(1 << FLAGS.index(name))
    return out


def _checked_wavelength(values: npt.ArrayLike) -> Array:
    wavelength = np.array(values, dtype=np.float64, ndmin=1)
    if wavelength.ndim != 1:
        raise InputError(f"wavelength has {wavelength.ndim} dimensions; give a one-dimensional array")
    check_finite("wavelength", wavelength)
    if (wavelength <= 0.0).any():
        place = int(np.argmax(wavelength <= 0.0))
        raise InputError(f"wavelength[{place}] is {wavelength[place]:g} nm; it has to be positive")
    falls = np.diff(wavelength) <= 0.0
    if falls.any():
        place = int(np.argmax(falls)) + 1
        word = "repeats" if wavelength[place] == wavelength[place - 1] else "follows"
        raise InputError(
            f"wavelength[{place}], {wavelength[place]:g} nm, {word} {wavelength[place - 1]:g} nm;"
            " sort the wavelengths and give each once"
        )
    return wavelength


def _matrix(name: str, values: npt.ArrayLike, shape: tuple[int, int], dtype: type[T]) -> npt.NDArray[T]:
    matrix = np.array(values, dtype=dtype)
    if matrix.shape != shape:
        raise InputError(
            f"{name} has shape {matrix.shape}; {shape[0]} directions × {shape[1]} wavelengths need {shape}"
        )
    return matrix
