"""`clbrdf devices`: what could run the kernels, and what will."""

from __future__ import annotations

import numpy as np

from clbrdf.cli.console import print_table
from clbrdf.cli.options import DeviceName
from clbrdf.device import choose_device, list_devices, vector_width


def command(*, device: DeviceName = None) -> None:
    """List the OpenCL devices, the one that would be used marked with *."""
    chosen = choose_device(device)
    rows = [
        [
            "*" if d == chosen else "",
            d.name,
            d.kind,
            " ".join(f"{d.platform}, {d.version}".split()[:8]),
            f"{d.compute_units}",
            f"{d.memory / 2**30:.1f}",
            f"{vector_width(d, np.float32)}",
            f"{vector_width(d, np.float64)}" if d.has_double else "–",
        ]
        for d in list_devices()
    ]
    columns = ("", "device", "kind", "platform", "units", "GiB", "fp32", "fp64")
    print_table("OpenCL devices; fp32, fp64: lanes a work item", columns, rows, left=4)
