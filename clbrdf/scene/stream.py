"""A scene into a scan file, block by block: memory holds a few blocks, however many values there are."""

from __future__ import annotations

import time
from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from clbrdf.progress import Report, silent
from clbrdf.scan.component_storage import write_components
from clbrdf.scan.effects import checked_effects, write_effects
from clbrdf.scan.flags import FLAGS, flag_unusable
from clbrdf.scan.storage import write_frame
from clbrdf.scene.block import Block
from clbrdf.scene.simulate import (
    Setting,
    blocks,
    components_of,
    flag_names,
    has_noise,
    has_sigma,
    instrument,
    noise_of,
    receiver,
    told_effects,
)
from clbrdf.storage import hdf5

if TYPE_CHECKING:
    import h5py

STREAM_VALUES = 1 << 21
"""Values of a block on the way to a file: 8 MiB in fp32."""


@dataclass(frozen=True)
class Streamed:
    """What was written.

    Attributes
    ----------
    values, flagged : int
    seconds, writing : float
        Wall time until the system has every value, and that of HDF5, most of it beside the computing.
    syncing : float
        Seconds after it until they are safe on the disk, and the file has its name.
    """

    values: int
    flagged: int
    seconds: float
    writing: float
    syncing: float


def stream(
    setting: Setting,
    path: str | Path,
    *,
    text: str = "",
    provenance: Mapping[str, str] | None = None,
    overwrite: bool = False,
    report: Report = silent,
) -> Streamed:
    """Simulate a scene into a scan file, whole or not at all.

    Values are stored as they are computed: fp32 where the arithmetic of the model has no more digits and no
    effect acts on them, fp64 else; neither compressed nor in chunks, since noise does not compress and
    a contiguous row goes to the disk as it is. Flags that are never set take no room.

    Parameters
    ----------
    text : str
        Of the scene file, kept in the scan: the truth behind its values.
    provenance : mapping of str to str

    Raises
    ------
    InputError
        The file exists and `overwrite` is False, or cannot be written.
    """
    began = time.perf_counter()
    scene = setting.scene
    written: list[_Written] = []
    with hdf5.create_file(path, "scan", f"simulated BRDF of {scene.sample or 'a sample'}", overwrite) as file:
        entry = file["entry"]
        n, w = len(setting.nominal), len(scene.wavelength)
        datasets: dict[str, h5py.Dataset] = {}
        under_way: Future[_Written] | None = None
        with ThreadPoolExecutor(max_workers=1) as pool:
            for block in blocks(setting, STREAM_VALUES):
                datasets = datasets or _begin(entry, setting, block.values.dtype)
                if under_way is not None:
                    written.append(under_way.result())
                    hdf5.check_written(file)
                under_way = pool.submit(_write, datasets, block)
                report(block.start + len(block.places), n)
            if under_way is not None:
                written.append(under_way.result())
        start = time.perf_counter()
        if text:
            entry["scene"] = text
        hdf5.write_mapping(entry, "provenance", provenance or {})
        file.flush()
        done = time.perf_counter()
    writing = sum(part.seconds for part in written) + done - start
    flagged = sum(part.flagged for part in written)
    return Streamed(n * w, flagged, done - began, writing, time.perf_counter() - done)


def _begin(entry: h5py.Group, setting: Setting, dtype: npt.DTypeLike) -> dict[str, h5py.Dataset]:
    """Write what stands beside the values, and make room for them."""
    scene, nominal = setting.scene, setting.nominal
    zero = np.zeros(len(nominal))
    angles = {"theta_i": nominal.theta_i, "phi_i": zero, "theta_r": nominal.theta_r, "phi_r": nominal.phi}
    data = write_frame(entry, angles, setting.wavelength, scene.sample, instrument(scene))
    write_effects(entry["instrument"], checked_effects(told_effects(scene)))
    shape = (len(nominal), len(scene.wavelength))
    solid, bandpass = receiver(scene, shape[0])
    if solid is not None:
        hdf5.field(data, "solid_angle", solid, "sr", "solid angle of the receiver")
    if bandpass is not None:
        hdf5.field(data, "bandpass", bandpass, "nm", "full width at half maximum")

    def room(name: str, kind: npt.DTypeLike, units: str, meaning: str) -> Any:
        dataset = data.create_dataset(name, shape, kind)
        dataset.attrs["units"] = units
        dataset.attrs["long_name"] = meaning
        return dataset

    datasets = {"brdf": room("brdf", dtype, "1/sr", "BRDF (1/sr)")}
    if has_sigma(scene):
        meaning = "standard uncertainty of the BRDF"
        datasets["brdf_errors"] = room("brdf_errors", np.float64, "1/sr", meaning)
    datasets["flags"] = room("flags", np.uint32, "", "reasons for masking, as bits")
    datasets["flags"].attrs["names"] = list(flag_names(scene))
    # Of noise 0 for now; a block writes its own.
    write_components(data, components_of(scene, 0.0), angles, shape)
    if has_noise(scene):
        datasets["noise"] = data["u_noise"]
    return datasets


class _Written(NamedTuple):
    """How many values of a block are flagged, and the seconds that writing took."""

    flagged: int
    seconds: float


def _write(datasets: dict[str, h5py.Dataset], block: Block) -> _Written:
    """Write a block, in a thread of its own while the next one is made."""
    start = time.perf_counter()
    return _Written(_write_values(datasets, block), time.perf_counter() - start)


def _write_values(datasets: dict[str, h5py.Dataset], block: Block) -> int:
    """Write a block; return how many of its values are flagged."""
    rows = slice(block.start, block.start + len(block.places))
    values = np.ascontiguousarray(block.values)
    datasets["brdf"].write_direct(values, dest_sel=np.s_[rows])
    if "brdf_errors" in datasets and block.variance is not None:
        datasets["brdf_errors"].write_direct(np.sqrt(block.variance), dest_sel=np.s_[rows])
    if "noise" in datasets:
        datasets["noise"].write_direct(np.ascontiguousarray(noise_of(block)), dest_sel=np.s_[rows])
    # NaN and infinity fail the comparison, too.
    if block.flagged is None and values.min() > 0.0 and values.max() < np.inf:
        return 0
    flags = np.zeros(values.shape, np.uint32)
    if block.flagged is not None:
        flags[block.flagged] = 1 << len(FLAGS)
    sigma = None if block.variance is None or "brdf_errors" not in datasets else np.sqrt(block.variance)
    flags = flag_unusable(values, flags, sigma)
    datasets["flags"].write_direct(flags, dest_sel=np.s_[rows])
    return int(np.count_nonzero(flags))
