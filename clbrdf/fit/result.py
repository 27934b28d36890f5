"""What comes out of a fit: parameters at every wavelength, how good they are, and what made them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.geometry import Directions, read_only
from clbrdf.models import Model, remade
from clbrdf.scan import Scan
from clbrdf.storage import hdf5, units
from clbrdf.storage.schema import Item, check_group, read_items, read_texts, text_list_attribute

if TYPE_CHECKING:
    import h5py

Array = npt.NDArray[np.float64]

STATUSES = ("converged", "at bound", "ambiguous", "not converged", "no data")
"""What a status says of one wavelength:

converged
    a stationary point inside the limits, and the data tell the parameters apart
at bound
    the same, with at least one parameter at its limit
ambiguous
    a stationary point, but other parameters fit as well: too few points or incident angles, or no
    specular part
not converged
    the polish ran out of iterations, or was asked to stop early (a tolerance)
no data
    every value is masked; the parameters are NaN
"""


@dataclass(frozen=True, eq=False)
class Fit:
    """A model fitted to a scan at W wavelengths; immutable.

    Attributes
    ----------
    scan : Scan
        What was fitted.
    model : Model
    parameters, sigma : mapping of str to (W,) float64
        Best values and their standard uncertainties, by name, in the units of the model's table. An
        uncertainty is NaN at a bound and infinite where the data cannot tell.
    objective : (W,) float64
        E of (13) with the weights used.
    relative_rms : (W,) float64
        σ_r of (14) over all directions.
    relative_rms_by_incident_angle : (I, W) float64
        σ_r of (14) for each of ``scan.incident_angles``.
    status : (W,) str
        One of STATUSES.
    correlation : (W, P, P) float64
        Of the parameters' uncertainties; NaN where one of the two has none.
    condition : (W,) float64
        Condition number of the weighted derivatives, columns scaled to unit length; infinite where the
        data cannot tell parameters apart.
    remarks : tuple of str
        For each wavelength what the data leave open there, in words; "" where nothing.
    evaluations : (W,) int64
        Evaluations of E, search and polish together.
    starts, agreeing : (W,) int64
        Starts of the polish, and how many of them ended at the E that is reported.
    acceptance : (W,) float64
        Share of proposed moves taken, NaN for methods that propose none.
    not_finite : (W,) int64
        Evaluations that were not finite and therefore refused.
    weights : (N, W) float64
        g of (13).
    bounds : (P, 2) float64
    method, device : str
        What searched, and where it ran.
    seed : int
    given : tuple of str
        Parameters that were not fitted: fixed, or the wavelength itself. They have no uncertainty (NaN).
    shared : tuple of str
        Parameters that are one number for all wavelengths, fitted to all of them together; `starts` and
        `agreeing` then count walks to the joint optimum.
    provenance : mapping of str to str
        Program version, settings, hash of the input.
    tolerance : tuple of str
        Which search a tolerance chose, and what the next better one costs; empty without one. Not saved,
        as `seconds`.
    seconds : float
        Wall time of the fit. Not saved: a file holds only what input, settings and seed determine.
    """

    scan: Scan
    model: Model
    parameters: Mapping[str, Array]
    sigma: Mapping[str, Array]
    objective: Array
    relative_rms: Array
    relative_rms_by_incident_angle: Array
    status: npt.NDArray[np.str_]
    correlation: Array
    condition: Array
    remarks: tuple[str, ...]
    evaluations: npt.NDArray[np.int64]
    starts: npt.NDArray[np.int64]
    agreeing: npt.NDArray[np.int64]
    acceptance: Array
    not_finite: npt.NDArray[np.int64]
    weights: Array
    bounds: Array
    method: str
    device: str
    seed: int
    given: tuple[str, ...] = ()
    shared: tuple[str, ...] = ()
    provenance: Mapping[str, str] = field(default_factory=dict)
    tolerance: tuple[str, ...] = ()
    seconds: float = float("nan")

    def __post_init__(self) -> None:
        for name in ("parameters", "sigma"):
            values = {key: read_only(np.asarray(value)) for key, value in getattr(self, name).items()}
            object.__setattr__(self, name, MappingProxyType(values))
        object.__setattr__(self, "remarks", tuple(self.remarks))
        object.__setattr__(self, "provenance", MappingProxyType(dict(self.provenance)))
        for name in ARRAYS:
            read_only(getattr(self, name))

    @property
    def wavelength(self) -> Array:
        """(W,), nm."""
        return self.scan.wavelength

    @property
    def vector(self) -> Array:
        """Parameters in table order, (W, P)."""
        return np.stack([self.parameters[name] for name in self.model.names], axis=-1)

    def evaluate(self, directions: Directions | None = None) -> Array:
        """Fitted BRDF, (N, W), 1/sr, in the scan's directions or others; NaN where there is no fit."""
        x = self.model.features(self.scan.directions if directions is None else directions)
        out: Array = self.model.brdf(self.vector[:, None, :], x).T
        return out

    def save(self, path: str | Path, overwrite: bool = False) -> None:
        """Write the fit with its scan as a NeXus HDF5 file, whole or not at all.

        The same input, settings, seed and device give the same bytes.

        Raises
        ------
        InputError
            The file exists and `overwrite` is False, or it cannot be written.
        """
        with self.creating(path, overwrite):
            pass

    @contextmanager
    def creating(self, path: str | Path, overwrite: bool = False) -> Iterator[h5py.Group]:
        """Write the fit as `save` does; more can be written into its entry while the block runs."""
        title = f"{self.model.title}, fitted to {self.scan.sample or 'a sample'}"
        with hdf5.create_file(path, "fit", title, overwrite) as file:
            entry = file["entry"]
            self.scan.write(entry)
            _write(self, hdf5.group(entry, "fit", "NXprocess"))
            yield entry

    @classmethod
    def open(cls, path: str | Path) -> Fit:
        """Read a fit file.

        Raises
        ------
        InputError
            The file is missing, damaged, of a newer version, or holds a scan only.
        """
        with hdf5.open_file(path) as file:
            hdf5.check_content(file, "fit")
            try:
                return _read(hdf5.find_entry(file, path))
            except InputError as error:
                raise InputError(f"{path}: {error}") from error


SCHEMA = (
    Item("objective", ("W",)),
    Item("relative_rms", ("W",)),
    Item("relative_rms_by_incident_angle", ("I", "W")),
    Item("status", ("W",), kind="bits"),
    Item("correlation", ("W", "P", "P")),
    Item("condition", ("W",)),
    Item("evaluations", ("W",), kind="whole"),
    Item("starts", ("W",), kind="whole"),
    Item("agreeing", ("W",), kind="whole"),
    Item("acceptance", ("W",)),
    Item("not_finite", ("W",), kind="whole"),
    Item("weights", ("N", "W")),
    Item("bounds", ("P", "2")),
)
"""Arrays in the file, N directions × W wavelengths, I incident zeniths, P parameters."""

ARRAYS = tuple(item.name for item in SCHEMA)
"""Attributes of a Fit that are arrays and go to the file under their own names."""


def _write(fit: Fit, group: h5py.Group) -> None:
    group["program"] = "clbrdf"
    for name in ("method", "device"):
        group[name] = getattr(fit, name)
    group["model"] = fit.model.name
    group["given"] = list(fit.given)
    group["shared"] = list(fit.shared)
    group["seed"] = fit.seed
    data = hdf5.group(group, "parameters", "NXdata")
    keys = [_key(name) for name in fit.model.names]
    data.attrs["signal"], data.attrs["auxiliary_signals"] = keys[0], keys[1:]
    data.attrs["axes"] = ["wavelength"]
    hdf5.field(data, "wavelength", fit.wavelength, "nm", "wavelength")
    for row in fit.model.parameters:
        key = _key(row.name)
        hdf5.field(data, key, fit.parameters[row.name], row.unit, row.meaning)
        hdf5.field(data, f"{key}_errors", fit.sigma[row.name], row.unit, f"1σ of {row.name}")
    hdf5.field(group, "incident_angles", fit.scan.incident_angles, "deg", "rows of σ_r by incident zenith")
    for name in ARRAYS:
        if name == "status":
            codes = np.array([STATUSES.index(str(s)) for s in fit.status], dtype=np.uint8)
            hdf5.field(group, name, codes, "").attrs["names"] = list(STATUSES)
        else:
            hdf5.field(group, name, getattr(fit, name), "1")
    group["remarks"] = list(fit.remarks)
    hdf5.write_mapping(group, "provenance", fit.provenance)


def _read(entry: h5py.Group) -> Fit:
    scan = Scan.read(entry)
    group = entry["fit"]
    check_group(group)
    data = group["parameters"]
    check_group(data)
    model = _model_of(hdf5.read_text(group, "model"), data)
    lengths = {"N": scan.brdf.shape[0], "W": scan.brdf.shape[1], "P": len(model.names)}
    arrays: dict[str, Any] = read_items(group, SCHEMA, lengths | {"I": len(scan.incident_angles)})
    rows = [
        Item(f"{_key(row.name)}{end}", ("W",), units.same_as(row.unit))
        for row in model.parameters
        for end in ("", "_errors")
    ]
    values = read_items(data, rows, lengths)
    names, codes = text_list_attribute(group["status"], "names"), arrays.pop("status")
    if codes.max() >= len(names):
        raise InputError(f"/entry/fit/status holds {codes.max()}, and {len(names)} statuses have names")
    return Fit(
        scan=scan,
        model=model,
        parameters={name: values[_key(name)] for name in model.names},
        sigma={name: values[f"{_key(name)}_errors"] for name in model.names},
        given=_names(group, "given"),
        shared=_names(group, "shared"),
        remarks=read_texts(group, "remarks", lengths["W"]),
        status=np.array([names[code] for code in codes]),
        method=hdf5.read_text(group, "method"),
        device=hdf5.read_text(group, "device"),
        seed=int(read_items(group, [Item("seed", kind="whole")])["seed"]),
        provenance=hdf5.read_mapping(group, "provenance"),
        **arrays,
    )


def _key(name: str) -> str:
    """Name of a parameter in the file, where "wavelength" is the axis."""
    return "wavelength_of_model" if name == "wavelength" else name


def _names(group: h5py.Group, name: str) -> tuple[str, ...]:
    """Names that a file of an earlier version does not hold."""
    return read_texts(group, name) if name in group else ()


def _model_of(name: str, data: h5py.Group) -> Model:
    """Return the model of a file by its name.

    Raises
    ------
    InputError
        It is a page of one's own that is not found, or that has changed its parameters.
    """
    try:
        model = remade(name)
    except InputError as error:
        raise InputError(
            f"its model {name!r} cannot be made: {error}. If a page of yours is part of it, name its folder"
            " in the environment variable CLBRDF_MODELS"
        ) from error
    missing = [row for row in model.names if _key(row) not in data]
    if missing:
        raise InputError(
            f"its model {name!r} had other parameters when it was fitted: {missing[0]} is not in the file"
        )
    return model
