"""Which OpenCL device runs the kernels.

A GPU is taken where there is one, else the CPU through PoCL, else any other CPU runtime. Installing
another runtime silently changes which platform comes first, so devices are chosen by kind and name, and
every result says which one ran.
"""

from __future__ import annotations

import os
import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import platformdirs

from clbrdf.errors import DeviceError

if TYPE_CHECKING:
    import pyopencl as cl

POCL = "Portable Computing Language"


@dataclass(frozen=True)
class Device:
    """An OpenCL device, told by plain values; equal records are the same device.

    Attributes
    ----------
    name, platform, version, driver : str
        As the runtime reports them; `version` is the platform's.
    kind : str
        "gpu", "cpu" or "other".
    compute_units : int
        Parallel units (cores on a CPU).
    memory : int
        Global memory, bytes.
    has_double : bool
        Whether it computes in fp64, which fits and `precision="double"` need.
    index : (int, int)
        Place among the platforms and their devices in this process.
    """

    name: str
    platform: str
    version: str
    driver: str
    kind: str
    compute_units: int
    memory: int
    has_double: bool
    index: tuple[int, int]

    def __str__(self) -> str:
        return f"{self.name} ({self.platform}, {' '.join(self.version.split()[:4])})"


def list_devices() -> list[Device]:
    """All OpenCL devices of this machine, the ones preferred first; empty where there is no runtime."""
    import pyopencl as cl

    try:
        platforms = cl.get_platforms()
    except cl.LogicError:  # the loader's way of saying that there is no platform
        return []
    found = []
    for i, platform in enumerate(platforms):
        try:
            devices = platform.get_devices()
        except cl.RuntimeError:
            continue
        found += [_describe(platform, device, (i, j)) for j, device in enumerate(devices)]
    return sorted(found, key=_rank)


def _describe(platform: cl.Platform, device: cl.Device, index: tuple[int, int]) -> Device:
    import pyopencl as cl

    kinds = {cl.device_type.GPU: "gpu", cl.device_type.CPU: "cpu"}
    return Device(
        name=device.name.strip(),
        platform=platform.name.strip(),
        version=" ".join(platform.version.split()),
        driver=device.driver_version.strip(),
        kind=next((name for bit, name in kinds.items() if device.type & bit), "other"),
        compute_units=int(device.max_compute_units),
        memory=int(device.global_mem_size),
        has_double="cl_khr_fp64" in device.extensions,
        index=index,
    )


def _rank(device: Device) -> tuple[int, int, tuple[int, int]]:
    kind = {"gpu": 0, "cpu": 1}.get(device.kind, 2)
    return kind, 0 if device.platform == POCL else 1, device.index


def choose_device(name: str | None = None) -> Device:
    """Return the preferred device, or the first whose name or platform contains `name` (any case).

    Raises
    ------
    DeviceError
        There is no OpenCL device, or none of this name.
    """
    devices = list_devices()
    if not devices:
        raise DeviceError(_why_none())
    if name is None:
        return devices[0]
    for device in devices:
        if name.casefold() in f"{device.name} {device.platform} {device.version}".casefold():
            return device
    there = "; ".join(str(d) for d in devices)
    raise DeviceError(f"no OpenCL device is called {name!r}; there are: {there}")


def usable_device(device: Device | str | None) -> Device:
    """Return a device as it is, the one of a name, or, without, the preferred one.

    Raises
    ------
    DeviceError
        As `choose_device`; what is given is neither.
    """
    if isinstance(device, Device):
        return device
    if device is None or isinstance(device, str):
        return choose_device(device)
    raise DeviceError(f"device is {device!r}; give part of its name, or a Device")


def _why_none() -> str:
    """Return why there is no device, and the mend."""
    import pyopencl as cl

    try:
        names = [platform.name.strip() for platform in cl.get_platforms()]
    except cl.LogicError:
        names = []
    if not names:
        return "no OpenCL platform found; install the CPU runtime with: pip install 'pyopencl[pocl]'"
    folder = _pocl_cache()
    if POCL in names and not _can_be_written(folder):
        return (
            f"PoCL cannot write its cache, {folder}, and gives no device; set POCL_CACHE_DIR to a folder that"
            " can be written"
        )
    return f"the OpenCL platform {' and '.join(names)} has no device; look at its installation"


def _pocl_cache() -> Path:
    """Return where PoCL keeps what it compiles, by its manual ("Environment variables")."""
    if own := os.environ.get("POCL_CACHE_DIR"):
        return Path(own)
    if caches := os.environ.get("XDG_CACHE_HOME"):
        return Path(caches) / "pocl"
    home = os.environ.get("HOME")
    return Path(home) / ".cache" / "pocl" if home else Path("/tmp/pocl")


def _pyopencl_cache() -> Path:
    """Return where PyOpenCL keeps what it makes of kernels (pytools.persistent_dict)."""
    if caches := os.environ.get("XDG_CACHE_HOME"):
        return Path(caches) / "pytools"
    return platformdirs.user_cache_path("pytools", "pytools", ensure_exists=False)


def _can_be_written(folder: Path) -> bool:
    """Whether files can be made in a folder, which may itself have to be made."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


@cache
def device_here(device: Device) -> Device:
    """Return the device of this process that is the same runtime on the same hardware.

    Raises
    ------
    DeviceError
        There is none.
    """
    for here in list_devices():
        if (str(here), here.driver, here.kind) == (str(device), device.driver, device.kind):
            # What the process may use of it, and its place, can differ from process to process.
            return here
    raise DeviceError(f"{device} is not here; there are: {'; '.join(map(str, list_devices())) or 'none'}")


@cache
def open_queue(device: Device) -> cl.CommandQueue:
    """Return the command queue of a device, one per process.

    Raises
    ------
    DeviceError
        PyOpenCL's cache cannot be written, without which it launches no kernel.
    """
    import pyopencl as cl

    folder = _pyopencl_cache()
    if not _can_be_written(folder):
        raise DeviceError(
            f"PyOpenCL cannot write its cache, {folder}; set XDG_CACHE_HOME to a folder that can be written"
        )

    platform, place = device.index
    context = cl.Context([cl.get_platforms()[platform].get_devices()[place]])
    return cl.CommandQueue(context)
