"""How a scan lies in an NXentry that follows NXoptical_spectroscopy where it fits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from clbrdf.geometry import ANGLES
from clbrdf.scan.component_storage import component_items, read_components, read_old_parts, write_components
from clbrdf.scan.effects import read_effects, write_effects
from clbrdf.scan.flags import FLAGS
from clbrdf.storage import hdf5, units
from clbrdf.storage.schema import (
    Item,
    check_group,
    read_items,
    read_text,
    text_attribute,
    text_list_attribute,
)

if TYPE_CHECKING:
    import h5py

    from clbrdf.scan.record import Scan

Array = npt.NDArray[np.float64]

MEANINGS = {
    "theta_i": "incident zenith",
    "phi_i": "incident azimuth",
    "theta_r": "view zenith",
    "phi_r": "view azimuth",
}

SCHEMA = (
    *(Item(name, ("N",), units.ANGLE) for name in ANGLES),
    Item("wavelength", ("W",), units.LENGTH, required=False),
    Item("brdf", ("N", "W"), units.BRDF),
    Item("brdf_errors", ("N", "W"), units.BRDF, required=False),
    Item("flags", ("N", "W"), kind="bits"),
    Item("solid_angle", ("N",), units.SOLID_ANGLE, required=False),
    Item("bandpass", ("W",), units.LENGTH, required=False),
)
"""Arrays of the NXdata, N directions × W wavelengths or bands."""

POLARISATIONS = ("source_polarisation", "detector_polarisation")


def write_frame(
    entry: h5py.Group,
    angles: Mapping[str, Array],
    wavelength: Array,
    sample_name: str,
    instrument_name: str,
    bands: Sequence[str] = (),
) -> h5py.Group:
    """Write what a scan says beside its values into an NXentry; return the NXdata that takes the values.

    `angles` holds theta_i, phi_i, theta_r, phi_r, each (N,), degrees. Where there are `bands`, their names
    stand in the place of wavelengths.
    """
    sides = np.unique(np.asarray(angles["theta_r"]) > 90.0)
    kind = ["reflection", "transmission"][int(sides[0])] if len(sides) == 1 else "reflection and transmission"
    function = "reflectance" if kind == "reflection" else "scattering"
    entry["definition"] = "NXoptical_spectroscopy"
    entry["experiment_type"] = f"{kind} spectroscopy"
    entry["experiment_sub_type"] = f"bidirectional {function} distribution function"
    sample = hdf5.group(entry, "sample", "NXsample")
    sample["name"] = sample_name
    instrument = hdf5.group(entry, "instrument", "NXinstrument")
    instrument["name"] = instrument_name
    instrument["angle_reference_frame"] = "sample-normal centered"
    data = hdf5.group(entry, "data", "NXdata")
    data.attrs["signal"] = "brdf"
    data.attrs["axes"] = [".", "." if bands else "wavelength"]
    for name in ANGLES:
        data.attrs[f"{name}_indices"] = 0
    for name, meaning in MEANINGS.items():
        hdf5.field(data, name, angles[name], "deg", meaning)
    if bands:
        data.attrs["bands"] = list(bands)
    else:
        data.attrs["wavelength_indices"] = 1
        hdf5.field(data, "wavelength", wavelength, "nm", "wavelength")
    return data


def write_scan(entry: h5py.Group, scan: Scan) -> None:
    """Write a scan into an NXentry."""
    angles = {name: getattr(scan, name) for name in ANGLES}
    data = write_frame(entry, angles, scan.wavelength, scan.sample, scan.instrument, scan.bands)
    hdf5.field(data, "brdf", scan.brdf, "1/sr", "BRDF (1/sr)")
    if scan.sigma is not None:
        hdf5.field(data, "brdf_errors", scan.sigma, "1/sr", "standard uncertainty of the BRDF")
    assert scan.flags is not None
    flags = hdf5.field(data, "flags", scan.flags, "", "reasons for masking, as bits")
    flags.attrs["names"] = list(scan.flag_names)
    if scan.solid_angle is not None:
        hdf5.field(data, "solid_angle", scan.solid_angle, "sr", "solid angle of the receiver")
    if scan.bandpass is not None:
        hdf5.field(data, "bandpass", scan.bandpass, "nm", "full width at half maximum")
    write_components(data, scan.components, angles, scan.brdf.shape)
    for name in POLARISATIONS:
        if getattr(scan, name) != "unknown":
            entry["instrument"].attrs[name] = getattr(scan, name)
    write_effects(entry["instrument"], scan.effects)
    hdf5.write_mapping(entry, "provenance", scan.provenance)


def read_frame(entry: h5py.Group) -> dict[str, Any]:
    """Read an NXentry: the arguments of a scan, by name.

    Raises
    ------
    InputError
        Arrays that do not belong together, of another type, larger than what the file stores, or without
        a known unit; texts that are none; effects that this version does not know.
    KeyError
        Something is missing.
    """
    for name in ("data", "sample", "instrument"):
        check_group(entry[name])
    data = entry["data"]
    check_group(data)
    arrays = read_items(data, (*SCHEMA, *component_items(data)))
    bands = tuple(text_list_attribute(data, "bands")) if "bands" in data.attrs else ()
    if not bands and "wavelength" not in arrays:
        arrays["wavelength"] = read_items(data, [Item("wavelength", ("W",), units.LENGTH)])["wavelength"]
    names = text_list_attribute(data["flags"], "names") if "names" in data["flags"].attrs else FLAGS
    return {
        **{name: arrays[name] for name in ANGLES},
        "wavelength": arrays.get("wavelength", np.full(len(bands), np.nan)),
        "brdf": arrays["brdf"],
        "sigma": arrays.get("brdf_errors"),
        "flags": arrays["flags"],
        "flag_names": tuple(names),
        "sample": read_text(entry["sample"], "name"),
        "instrument": read_text(entry["instrument"], "name"),
        "provenance": hdf5.read_mapping(entry, "provenance"),
        "bands": bands,
        **{name: text_attribute(entry["instrument"], name, "unknown") for name in POLARISATIONS},
        "solid_angle": arrays.get("solid_angle"),
        "bandpass": arrays.get("bandpass"),
        "effects": read_effects(entry["instrument"]),
        "components": read_components(data, arrays) or read_old_parts(entry, arrays["brdf"]),
    }
