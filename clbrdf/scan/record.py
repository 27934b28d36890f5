"""A measured (or simulated) spectral BRDF: what goes into a fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.geometry import ANGLES, Directions, checked_angles, wrap_azimuth
from clbrdf.records import Record, frozen_map, html_table
from clbrdf.scan.average import averaged
from clbrdf.scan.check import checked_bands, checked_wavelength, matrix, widths
from clbrdf.scan.component import Component, checked_components, random_part, root_sum
from clbrdf.scan.effects import Effects, checked_effects
from clbrdf.scan.flags import FLAGS, check_flag_names, counted, flag_unusable
from clbrdf.scan.frame import to_dataframe, to_xarray
from clbrdf.scan.join import joined
from clbrdf.scan.rectangle import group_numbers
from clbrdf.scan.select import Index, in_columns, in_rows, picked, selected
from clbrdf.scan.storage import POLARISATIONS, read_frame, write_scan
from clbrdf.scan.told import main_rows, one_line, title_of
from clbrdf.storage import hdf5

if TYPE_CHECKING:
    import h5py
    import pandas as pd
    import xarray as xr

Array = npt.NDArray[np.float64]

POLARISATION = ("unknown", "unpolarised", "s", "p")
"""Of the light that comes in, or of what is detected: s has its field normal to the plane of incidence."""


@dataclass(frozen=True, eq=False)
class Scan(Record):
    """BRDF of one sample in N directions at W wavelengths; immutable.

    Values that cannot be used are flagged when the record is made: NaN, infinite, and values at or below
    zero that no standard uncertainty allows (`flags.py`). A value with any flag is masked: kept, shown,
    counted, and never fitted.

    Attributes
    ----------
    theta_i, phi_i, theta_r, phi_r : (N,) float64
        Incident zenith [0, 90), view zenith [0, 90) for reflection or (90, 180] for transmission, and
        azimuths [0, 360), degrees.
    wavelength : (W,) float64
        nm, positive, strictly increasing; all NaN where `bands` are given.
    brdf : (N, W) float64
        1/sr, without the cosine; for transmission the BTDF.
    sigma : (N, W) float64 or None
        Standard uncertainty of `brdf`, 1/sr, of all components together; NaN where unknown; None where there
        is none at all. Where it is not given, that of the components.
    flags : (N, W) uint32
        Reasons for masking, bit k named by ``flag_names[k]``.
    flag_names : tuple of str
        At most 32.
    sample, instrument : str
        What was measured, and with what.
    provenance : mapping of str to str
        Who made it: program version, command, seed, hashes of inputs.
    bands : tuple of str
        Names of the W columns where they are no wavelengths, such as R, G, B; else empty.
    source_polarisation, detector_polarisation : str
        One of POLARISATION.
    solid_angle : (N,) float64 or None
        Of the receiver as seen from the sample, sr; NaN where unknown. A number stands for all directions.
    bandpass : (W,) float64 or None
        Full width at half maximum, nm; NaN where unknown. A number stands for all wavelengths.
    effects : mapping of str to mapping of str to float or bool
        Others that a fit can take out, with a scene's names and settings (`clbrdf.scan.effects`).
    components : tuple of Component
        Of the uncertainty, with what their errors have in common; empty where nothing is known of it.

    Raises
    ------
    InputError
        Shapes that do not agree, angles or wavelengths out of range or out of order, unknown effects.

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
    bands: tuple[str, ...] = ()
    source_polarisation: str = "unknown"
    detector_polarisation: str = "unknown"
    solid_angle: Array | None = None
    bandpass: Array | None = None
    components: tuple[Component, ...] = ()
    effects: Effects = field(default_factory=dict)

    def __post_init__(self) -> None:
        angles = checked_angles(*(getattr(self, name) for name in ANGLES))
        for name, values in zip(ANGLES, angles, strict=True):
            self._set(name, values)
        object.__setattr__(self, "bands", checked_bands(self.bands))
        self._set("wavelength", checked_wavelength(self.wavelength, self.bands))
        shape = (len(self.theta_i), len(self.wavelength))
        if 0 in shape:
            raise InputError(f"a scan of {shape[0]} directions and {shape[1]} wavelengths holds nothing")
        self._set("brdf", matrix("brdf", self.brdf, shape, np.float64))
        object.__setattr__(self, "components", checked_components(self.components, shape))
        if self.sigma is None and self.components:
            with np.errstate(invalid="ignore"):  # what is not finite is flagged below
                total = root_sum(self.components, self.brdf)
            object.__setattr__(self, "sigma", np.where(np.isfinite(total), total, np.nan))
        if self.sigma is not None:
            sigma = matrix("sigma", self.sigma, shape, np.float64)
            if (sigma < 0.0).any() or np.isinf(sigma).any():
                place = tuple(int(k[0]) for k in np.nonzero((sigma < 0.0) | np.isinf(sigma)))
                raise InputError(
                    f"sigma{list(place)} is {sigma[place]:g}; give a positive value, or NaN if unknown"
                )
            self._set("sigma", sigma)
        object.__setattr__(self, "flag_names", check_flag_names(self.flag_names))
        given = np.zeros(shape, np.uint32) if self.flags is None else self.flags
        self._set("flags", flag_unusable(self.brdf, matrix("flags", given, shape, np.uint32), self.sigma))
        object.__setattr__(self, "provenance", frozen_map(self.provenance))
        object.__setattr__(self, "effects", checked_effects(self.effects))
        for name in POLARISATIONS:
            if getattr(self, name) not in POLARISATION:
                raise InputError(f"{name} is {getattr(self, name)!r}; give one of {', '.join(POLARISATION)}")
        for name, length in (("solid_angle", shape[0]), ("bandpass", shape[1])):
            if getattr(self, name) is not None:
                self._set(name, widths(name, getattr(self, name), length))

    def _set(self, name: str, values: npt.NDArray[np.generic]) -> None:
        values.flags.writeable = False
        object.__setattr__(self, name, values)

    def __len__(self) -> int:
        return len(self.theta_i)

    def __repr__(self) -> str:
        return one_line(self)

    def _repr_html_(self) -> str:
        return html_table("Scan", main_rows(self))

    def __getitem__(self, index: Index | tuple[Index, Index]) -> Scan:
        """Return the scan in some directions, and with a second index at some wavelengths.

        Each is a slice, an array of places, or a mask; `sel` takes angles and wavelengths.

        Examples
        --------
        >>> scan = Scan([30.0, 40.0], 0.0, 30.0, 180.0, [550.0, 650.0], [[0.3, 0.4], [0.5, 0.6]])
        >>> scan[scan.theta_i > 35.0, :1].brdf
        array([[0.5]])
        """
        return selected(self, index)

    def sel(
        self,
        *,
        wavelength: float | slice | Sequence[float] | None = None,
        theta_i: float | slice | Sequence[float] | None = None,
        phi_i: float | slice | Sequence[float] | None = None,
        theta_r: float | slice | Sequence[float] | None = None,
        phi: float | slice | Sequence[float] | None = None,
    ) -> Scan:
        """Return the scan at some wavelengths, nm, and in directions of some angles, degrees.

        A number or several take values that are the same to 1e-6°, of wavelengths the nearest; a slice takes
        what lies between, both ends included: ``scan.sel(wavelength=slice(400, 700), theta_i=30)``.

        Raises
        ------
        InputError
            Nothing is left, or wavelengths are asked of a scan of bands.
        """
        asked = {"theta_i": theta_i, "phi_i": phi_i, "theta_r": theta_r, "phi": phi}
        return picked(self, asked, wavelength)

    def to_dataframe(self) -> pd.DataFrame:
        """Return a table of pandas, one row a value; needs the extra clbrdf[table]."""
        return to_dataframe(self)

    def to_xarray(self) -> xr.Dataset:
        """Return a dataset of xarray over direction and wavelength; needs the extra clbrdf[table]."""
        return to_xarray(self)

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
    def random_sigma(self) -> Array | None:
        """Standard uncertainty (N, W), 1/sr, of what differs from direction to direction; None if unknown.

        Of the components that are random over directions; without components all of `sigma`. Relative
        components are taken of the measured values.
        """
        return random_part(self.components, self.brdf, self.sigma)

    @property
    def common_components(self) -> tuple[Component, ...]:
        """The components whose errors different directions have in common."""
        return tuple(one for one in self.components if not one.is_random)

    @property
    def directions(self) -> Directions:
        """The N directions as one record."""
        return Directions(self.theta_i, self.phi_i, self.theta_r, self.phi_r)

    @property
    def transmitted(self) -> npt.NDArray[np.bool_]:
        """(N,), True where the view direction lies beyond the surface, θr > 90°."""
        return np.greater(self.theta_r, 90.0)

    @property
    def side(self) -> npt.NDArray[np.str_]:
        """(N,), "reflection" or "transmission"."""
        return self.directions.side

    @property
    def incident_angles(self) -> Array:
        """The distinct incident zeniths, increasing, degrees."""
        return np.unique(self.theta_i)

    @property
    def labels(self) -> tuple[str, ...]:
        """What the columns are called: "550 nm", or the names of the bands."""
        return self.bands or tuple(f"{value:g} nm" for value in self.wavelength)

    @property
    def column_keys(self) -> npt.NDArray[np.uint32]:
        """A number for each column, (W,): its picometres, or the place of its band.

        It names the column for random numbers, so that it draws the same whatever else is in the scan.
        """
        if self.bands:
            return np.arange(len(self.bands), dtype=np.uint32)
        return np.round(self.wavelength * 1000.0).astype(np.uint64).astype(np.uint32)

    def flag_counts(self) -> dict[str, int]:
        """How many values carry each reason, those that occur."""
        assert self.flags is not None
        return counted(self.flags, self.flag_names)

    def at(self, wavelengths: npt.ArrayLike) -> Scan:
        """Return the scan at the measured wavelengths nearest to those given, nm.

        Raises
        ------
        InputError
            The scan has bands and no wavelengths.
        """
        if self.bands:
            raise InputError(f"the scan has the bands {', '.join(self.bands)} and no wavelengths")
        wanted = np.atleast_1d(np.asarray(wavelengths, dtype=np.float64))
        nearest = np.abs(self.wavelength[None, :] - wanted[:, None]).argmin(axis=1)
        return self.columns(np.unique(nearest))

    def columns(self, index: Sequence[int] | slice | npt.NDArray[np.intp]) -> Scan:
        """Return the scan at some of its wavelengths, by their places."""
        return in_columns(self, index)

    def rows(self, index: Sequence[int] | slice | npt.NDArray[np.bool_] | npt.NDArray[np.intp]) -> Scan:
        """Return the scan in some of its directions, by their places or where a (N,) mask is True."""
        return in_rows(self, index)

    def reflection(self) -> Scan:
        """Return the scan without its directions of transmission.

        Raises
        ------
        InputError
            There are no others.
        """
        beyond = self.transmitted
        if not beyond.any():
            return self
        if beyond.all():
            raise InputError(f"all {len(self)} directions are of transmission, and reflection is needed here")
        return self.rows(~beyond)

    @classmethod
    def merge(cls, scans: Sequence[Scan]) -> Scan:
        """Return one scan of several: more directions, more wavelengths, or both.

        Directions are the same where all four angles and the receiver's solid angle are. A value measured
        again makes a repeat of its direction; what no scan has measured is flagged "not_measured". Components
        of the uncertainty that have the same name are one source in all scans.

        Raises
        ------
        InputError
            No scans; scans of bands and of wavelengths, of different polarisation, or of different effects.
        """
        return cls(**joined([{f.name: getattr(scan, f.name) for f in fields(scan)} for scan in scans]))

    def repeated_directions(self) -> int:
        """How many directions repeat an earlier one exactly (drift checks, repeats)."""
        numbers = group_numbers(np.stack([getattr(self, name) for name in ANGLES], axis=1))
        return len(numbers) - int(numbers.max()) - 1

    def averaged(self) -> Scan:
        """Return the scan with repeats of a direction as one: means of what is not masked.

        Weights of the mean are 1/σ² where all repeats of a value have a σ above 0, else equal. σ of the mean
        follows from those of the repeats, taken as independent; it does not follow from their scatter.
        Where all repeats are masked, the flags of the first stay. Solid angles are means.

        Raises
        ------
        InputError
            The scan has components of uncertainty, which the mean of repeats would mix.
        """
        if self.components:
            raise InputError("a mean of repeats would mix the components of the uncertainty; leave them out")
        numbers = group_numbers(np.stack([getattr(self, name) for name in ANGLES], axis=1))
        if numbers.max() + 1 == len(numbers):
            return self
        return replace(self, **averaged(self, numbers))

    def rotations(self) -> Array:
        """Return the incident azimuths, degrees, where some θi, θr, φ was measured at several; else none.

        There are some where a scan can tell whether the sample is anisotropic.
        """
        relative = group_numbers(np.stack([self.theta_i, self.theta_r, self.phi], axis=1))
        full = group_numbers(np.stack([getattr(self, name) for name in ANGLES], axis=1))
        return np.unique(self.phi_i) if full.max() > relative.max() else np.empty(0)

    def save(self, path: str | Path, overwrite: bool = False) -> None:
        """Write the scan as a NeXus HDF5 file, whole or not at all.

        Raises
        ------
        InputError
            The file exists and `overwrite` is False, or it cannot be written.
        """
        with hdf5.create_file(path, "scan", title_of(self), overwrite, "entry") as file:
            self.write(file["entry"])

    @classmethod
    def open(cls, path: str | Path) -> Scan:
        """Read a scan file, or of several scans in it the one named as in ``file.h5::name``.

        Of a fit file, the scan that was fitted.

        Raises
        ------
        InputError
            The file is missing, damaged, of a newer version, or holds neither; it holds several scans and
            none is named, or none of that name.
        """
        with hdf5.open_file(path) as file:
            if hdf5.content_of(file) != "fit":
                hdf5.check_content(file, "scan")
            try:
                return cls.read(hdf5.find_entry(file, path))
            except InputError as error:
                raise InputError(f"{path}: {error}") from error

    def write(self, entry: h5py.Group) -> None:
        """Write the scan into an NXentry that follows NXoptical_spectroscopy where it fits."""
        write_scan(entry, self)

    @classmethod
    def read(cls, entry: h5py.Group) -> Scan:
        """Read what `write` wrote.

        Raises
        ------
        InputError
            Something in it is damaged, or has an unknown unit.
        KeyError
            Something is missing.
        """
        return cls(**read_frame(entry))
