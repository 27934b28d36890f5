"""Components of the uncertainty in a scan file, as the CoMET tools write them.

Beside `brdf` stands one array u_… for each component, named in its attribute `unc_comps`. Along dimension k
(1 direction, 2 wavelength, 3 incident_angle) the attributes err_corr_k_dim, _form, _params and _units say how
its errors belong together. The forms random, systematic and err_corr_matrix are those of obsarray; bells and
groups of up to MOST_PLACES places are written as err_corr_matrix, too, and the array of coefficients says
in `follows_form` what it was made from. Incident angles are no dimension of the array: their correlation is
part of the matrix over directions.

Source: https://obsarray.readthedocs.io, "Interfacing with uncertainty information" and the UNC specification.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.scan.component import DIMENSIONS, RANDOM, SYSTEMATIC, Component
from clbrdf.scan.correlation import Correlation
from clbrdf.storage import hdf5, units
from clbrdf.storage.schema import Item, read_items, text_attribute, text_list_attribute

if TYPE_CHECKING:
    import h5py

Array = npt.NDArray[np.float64]

MOST_PLACES = 2048
"""Places up to which coefficients are written one by one for programs that know no bells and no groups."""

KNOWN = ("random", "systematic", "matrix")
"""Forms that other programs know."""

UNITS = {**units.BRDF, "%": 0.01}

UNIT_OF_WIDTH = {"direction": "deg", "incident_angle": "deg", "wavelength": "nm"}


def write_components(
    data: h5py.Group, components: Sequence[Component], angles: Mapping[str, Array], shape: tuple[int, int]
) -> None:
    """Write components of N × W values into the NXdata that holds `brdf`; `angles` of the scan, degrees."""
    if not components:
        return
    (n, w), components = shape, [one.sized(shape) for one in components]
    spectral = "wavelength" if "wavelength" in data else "band"
    # Named dimensions, as netCDF has them, so that other programs see what belongs to what.
    hdf5.field(data, "direction", np.arange(n), "1", "number of the direction").make_scale("direction")
    if spectral == "band":
        hdf5.field(data, "band", np.arange(w), "1", "number of the band")
    data[spectral].make_scale(spectral)
    names: list[str] = []
    for one in components:
        key = _key(one.name, names)
        names.append(key)
        _write(data, key, one, angles, data[spectral][()], spectral)
    for name in ("brdf", *names, *(extra for extra in ("brdf_errors", "flags") if extra in data)):
        data[name].dims[0].attach_scale(data["direction"])
        data[name].dims[1].attach_scale(data[spectral])
    data["brdf"].attrs["unc_comps"] = names


def _key(name: str, taken: Sequence[str]) -> str:
    key = "u_" + (re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_") or "component")
    return next(k for j in range(1, len(taken) + 2) if (k := key if j == 1 else f"{key}_{j}") not in taken)


def _write(
    data: h5py.Group, key: str, one: Component, angles: Mapping[str, Array], spectrum: Array, spectral: str
) -> None:
    values = np.asarray(one.values)
    scale, unit = (100.0, "%") if one.relative else (1.0, "1/sr")
    if values.strides == (0, 0):
        # One number for all takes no room.
        dataset = data.create_dataset(key, values.shape, np.float64, fillvalue=scale * values.flat[0])
        dataset.attrs["units"], dataset.attrs["long_name"] = unit, one.name
    else:
        dataset = hdf5.field(data, key, scale * values, unit, one.name)
    dataset.attrs["pdf_shape"] = "gaussian"

    def say(place: int, dimension: str, correlation: Correlation, coefficients: Array | None) -> None:
        form, params, unit_of = _written(data, key, dimension, correlation, coefficients)
        prefix = f"err_corr_{place}_"
        dataset.attrs[prefix + "dim"] = spectral if dimension == "wavelength" else dimension
        dataset.attrs[prefix + "form"] = form
        dataset.attrs[prefix + "params"] = params
        dataset.attrs[prefix + "units"] = unit_of

    small = values.shape[0] <= MOST_PLACES
    plain = one.direction.form in KNOWN and one.incident_angle.form == "systematic"
    matrix = None if plain or one.is_random or not small else one.direction_coefficients(angles)
    say(1, "direction", one.direction, matrix)
    small = values.shape[1] <= MOST_PLACES
    plain = one.wavelength.form in KNOWN
    say(
        2,
        "wavelength",
        one.wavelength,
        one.wavelength.coefficients(spectrum) if small and not plain else None,
    )
    if one.incident_angle.form != "systematic":
        say(3, "incident_angle", one.incident_angle, None)


def _written(
    data: h5py.Group, key: str, dimension: str, correlation: Correlation, coefficients: Array | None
) -> tuple[str, Any, Any]:
    """Write what a correlation needs beside its name; return form, params and units as attributes."""
    nothing = np.zeros(0)
    params: Any = nothing
    if correlation.groups is not None:
        params = f"{key}_{dimension}_groups"
        hdf5.field(data, params, correlation.groups, "1", f"groups of {dimension}s")
    elif correlation.form == "bell":
        params = np.array([correlation.width])
    elif correlation.matrix is not None:
        params = f"{key}_{dimension}_matrix"
        hdf5.field(data, params, correlation.matrix, "1", f"error correlation over {dimension}s")
    unit_of: Any = UNIT_OF_WIDTH[dimension] if correlation.form == "bell" else nothing
    if coefficients is None:
        form = "err_corr_matrix" if correlation.form == "matrix" else correlation.form
        return form, params, unit_of
    name = f"{key}_{dimension}_corr"
    whole = np.isin(coefficients, (0.0, 1.0)).all()
    stored = coefficients.astype(np.int8) if whole else coefficients
    dataset = hdf5.field(data, name, stored, "1", f"error correlation over {dimension}s, all in all")
    dataset.attrs["follows_form"], dataset.attrs["follows_params"] = correlation.form, params
    return "err_corr_matrix", name, nothing


def component_items(data: h5py.Group) -> tuple[Item, ...]:
    """Return the arrays that hold components, as `brdf` lists them; none in a file without."""
    if "brdf" not in data or "unc_comps" not in data["brdf"].attrs:
        return ()
    names = text_list_attribute(data["brdf"], "unc_comps")
    for name in names:
        if name not in data:
            raise InputError(f"{data.name} lists the component {name!r} and does not hold it; make it again")
        found, needed = getattr(data[name], "shape", None), getattr(data["brdf"], "shape", None)
        if found != needed:
            raise InputError(
                f"component {name!r} has shape {found}, and brdf has {needed}; write it for every direction"
                " and wavelength"
            )
    return tuple(Item(name, ("N", "W"), UNITS) for name in names)


def read_components(data: h5py.Group, arrays: Mapping[str, npt.NDArray[Any]]) -> tuple[Component, ...]:
    """Read the components whose values have been read into `arrays`.

    Raises
    ------
    InputError
        Naming the component: a correlation that is none, or of a form that is not known.
    """
    return tuple(_read(data, item.name, arrays[item.name]) for item in component_items(data))


def _read(data: h5py.Group, key: str, values: Array) -> Component:
    dataset = data[key]
    name = text_attribute(dataset, "long_name") or key
    correlations = {"direction": RANDOM, "incident_angle": SYSTEMATIC, "wavelength": RANDOM}
    try:
        for place in range(1, 10):
            prefix = f"err_corr_{place}_"
            if f"{prefix}dim" not in dataset.attrs:
                continue
            # One attribute may speak of several dimensions at once.
            for written in text_list_attribute(dataset, f"{prefix}dim"):
                dimension = "wavelength" if written == "band" else written
                if dimension not in DIMENSIONS:
                    raise InputError(f"{written!r} is no dimension; there are {', '.join(DIMENSIONS)}")
                correlations[dimension] = _correlation(data, dataset, prefix)
        if dataset.id.get_storage_size() == 0:
            values = np.broadcast_to(values.flat[:1].reshape(1, 1), values.shape)
        relative = text_attribute(dataset, "units") == "%"
        return Component(name, values, relative, **correlations)
    except InputError as error:
        raise InputError(f"component {name!r} ({dataset.name}): {error}") from error


def _correlation(data: h5py.Group, dataset: Any, prefix: str) -> Correlation:
    form, params = text_attribute(dataset, f"{prefix}form"), dataset.attrs.get(f"{prefix}params")
    if form == "err_corr_matrix":
        source = data.get(_text(params) or "?")
        form = "matrix"
        if source is not None and "follows_form" in source.attrs:
            form, params = text_attribute(source, "follows_form"), source.attrs.get("follows_params")
    if form == "matrix":
        return Correlation("matrix", matrix=_array(data, params, ("M", "M")))
    if form == "groups":
        return Correlation("groups", groups=_array(data, params, ("M",)).astype(np.int64))
    if form == "bell":
        width = np.ravel(np.asarray(params))
        if width.size != 1 or width.dtype.kind not in "fiu":
            raise InputError("a bell has no width; give one number as err_corr params")
        return Correlation("bell", width=float(width[0]))
    return Correlation(form)


def _array(data: h5py.Group, params: Any, axes: tuple[str, ...]) -> Array:
    name = _text(params)
    if not name or name not in data:
        raise InputError(f"its correlation names the array {name!r}, which is not there")
    return np.asarray(read_items(data, [Item(name, axes, None)])[name], dtype=np.float64)


def _text(params: Any) -> str:
    value = np.ravel(np.asarray(params)).tolist()
    first = value[0] if value else ""
    return first.decode("utf-8", "replace") if isinstance(first, bytes) else str(first)


def read_old_parts(entry: h5py.Group, brdf: Array) -> tuple[Component, ...]:
    """Read what calibration wrote before there were components: a part by point and a scale part."""
    group = entry.get("uncertainty")
    names = ("brdf_errors_point", "brdf_errors_scale")
    if group is None or not hasattr(group, "keys") or not all(name in group for name in names):
        return ()
    parts = read_items(group, [Item(name, ("N", "W"), units.BRDF) for name in names])
    if parts[names[0]].shape != brdf.shape:
        raise InputError(
            f"{group.name} has parts of shape {parts[names[0]].shape}, and brdf has {brdf.shape};"
            " calibrate again"
        )
    point, scale = (np.nan_to_num(parts[name]) for name in names)
    size = np.abs(brdf)
    share = np.divide(scale, size, out=np.zeros_like(scale), where=np.isfinite(size) & (size > 0.0))
    return (
        Component("point", point, False, RANDOM, SYSTEMATIC, RANDOM),
        Component("scale", share, True, SYSTEMATIC, SYSTEMATIC, SYSTEMATIC),
    )
