"""OpenCL programs: sources joined in Python, built once per device and variant.

The text of a program is: constants of the variant (precision, lanes, the model's parameter and feature
names), vectors, exp2 and directions, the model, the library files a job asks for, the job. Nothing is
left to the compiler's include path, which breaks on folders with a space; `#line` markers keep the file
names in messages.

What is not asked for is not in the text: a line of a job that ends in `//@name` stays only where the
variant asks for that part.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING

import numpy as np

from clbrdf.errors import DeviceError
from clbrdf.models import Model
from clbrdf.models.model import LOG2_OF_ZERO
from clbrdf.opencl.device import Device, open_queue
from clbrdf.opencl.lanes import Lanes, lanes_of
from clbrdf.opencl.precision import Precision

if TYPE_CHECKING:
    import pyopencl as cl

# -cl-fast-relaxed-math is never used: it deletes the rounding in exp2. Signed zeros carry nothing here.
BUILD_OPTIONS = ["-cl-std=CL1.2", "-cl-no-signed-zeros", "-cl-mad-enable"]


@dataclass(frozen=True)
class Variant:
    """What a program is built for.

    Attributes
    ----------
    job : str
        A file in kernels.
    model : Model
    precision : Precision
    lanes : Lanes
    library : tuple of str
        Files in kernels/lib that the job takes. "pair" comes before the model and makes it careful,
        "direction" before it and lets it form its features on the device; the others come after it.
    parts : tuple of str
        Lines of the job that are marked by these names.
    free : tuple of int or None
        Places of the parameters that a fit may change; None is all of them.
    """

    job: str
    model: Model
    precision: Precision
    lanes: Lanes
    library: tuple[str, ...] = ()
    parts: tuple[str, ...] = ()
    free: tuple[int, ...] | None = None

    @classmethod
    def on(
        cls,
        device: Device,
        job: str,
        model: Model,
        precision: Precision,
        library: tuple[str, ...] = (),
        parts: tuple[str, ...] = (),
        free: tuple[int, ...] | None = None,
    ) -> Variant:
        """Return the variant with the lanes that suit a device."""
        return cls(job, model, precision, lanes_of(device, precision.dtype), library, parts, free)


def kernel_text(path: str) -> str:
    """Return a file of the kernels folder behind a `#line` marker."""
    text = resources.files("clbrdf.kernels").joinpath(path).read_text(encoding="utf-8")
    return f'#line 1 "kernels/{path}"\n{text}\n'


def only(text: str, wanted: Collection[str]) -> str:
    """Return a kernel text without the lines marked by names that are not wanted; line numbers stay."""
    lines = []
    for line in text.split("\n"):
        code, marker, name = line.partition("//@")
        lines.append((code.rstrip() if name in wanted else "") if marker else line)
    return "\n".join(lines)


def philox_text() -> str:
    """Return Philox 4x32-10 from PyOpenCL's own headers, with its includes resolved.

    Source: Salmon, Moraes, Dror, Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC11 (2011),
    doi:10.1145/2063384.2063405, as shipped by PyOpenCL.
    """
    folder = resources.files("pyopencl").joinpath("cl", "pyopencl-random123")
    parts = []
    for name in ("openclfeatures.h", "array.h", "philox.cl"):
        text = folder.joinpath(name).read_text(encoding="utf-8")
        lines = [line for line in text.splitlines() if not line.startswith('#include "')]
        parts.append(f'#line 1 "pyopencl-random123/{name}"\n' + "\n".join(lines) + "\n")
    return "".join(parts)


def constants_text(variant: Variant) -> str:
    """Return the macros that follow from precision, lanes and model table.

    The place of parameter alpha is P_alpha, that of ggx.alpha in a sum P_ggx_alpha.
    """
    model = variant.model
    rows = model.parameters
    kind = "double" if variant.precision.dtype is np.float64 else "float"
    lines = [f"#define REAL {kind}", f"#define WIDTH {variant.lanes.width}"]
    lines += [f"#define UNROLL {variant.lanes.unroll}", f"#define EXP2_DEGREE {variant.precision.degree}"]
    if kind == "double":
        lines.append("#define REAL_IS_DOUBLE")
    if "pair" in variant.library:
        lines.append("#define CAREFUL")
    if "direction" in variant.library:
        lines.append("#define FEATURES_ON_DEVICE")
    lines.append(f"#define LOG2_OF_ZERO {LOG2_OF_ZERO:.1f}{'' if kind == 'double' else 'f'}")
    lines += [f"#define P {len(rows)}", f"#define F {len(model.feature_names)}"]
    lines.append(f"#define TERMS {len(model.linear)}")
    lines += [f"#define P_{row.symbol} {j}" for j, row in enumerate(rows)]
    free = range(len(rows)) if variant.free is None else variant.free
    solved = [j for j in free if rows[j].linear]
    searched = [j for j in free if not rows[j].linear]
    tables = {
        "on_log_scale": [int(row.scale == "log") for row in rows],
        "sign_of": [int(row.sign) for row in rows],
        "free_place": list(free),
        "linear_place": solved,
        "searched_place": searched,
        "term_of": [model.linear.index(j) for j in solved],
    }
    lines += [f"#define {name} {len(tables[table])}" for name, table in COUNTS.items()]
    # A table of no entries is not C; its one entry is not looked at.
    lines += [
        f"constant int {name}[] = {{{', '.join(map(str, values or [0]))}}};"
        for name, values in tables.items()
    ]
    return "\n".join(lines) + "\n"


COUNTS = {"FREE": "free_place", "LINEAR": "linear_place", "NONLINEAR": "searched_place"}
"""Macros that count the entries of a table."""


def geometry_text(model: Model) -> str:
    """Return the record of geometry features, and the two ways to load it."""
    fields = ", ".join(model.feature_names) or "none"
    lanes = "\n".join(
        f"    x.{name} = LOAD(group, rows + {j} * n_padded);" for j, name in enumerate(model.feature_names)
    )
    start = "" if model.feature_names else " = {(realv)0}"
    same = "\n".join(f"    x.{name} = (realv)row[n * F + {j}];" for j, name in enumerate(model.feature_names))
    return (
        f"typedef struct {{ realv {fields}; }} geometry;\n"
        "inline geometry geometry_lanes(global const real *rows, ulong n_padded, size_t group) {\n"
        f"    geometry x{start};\n{lanes}\n    return x;\n}}\n"
        "inline geometry geometry_of(global const real *row, size_t n) {\n"
        f"    geometry x{start};\n{same}\n    return x;\n}}\n"
    )


ARITHMETIC = ("vector", "sqrt", "exp2", "log", "erfcx")
"""Files of kernels/lib that any model may call."""

BEFORE_MODEL = ("direction", "pair")


def model_text(variant: Variant) -> str:
    """Return the text up to and with the model's functions: what every job begins with."""
    return (
        constants_text(variant)
        + "".join(kernel_text(f"lib/{name}.cl") for name in ARITHMETIC)
        + geometry_text(variant.model)
        + "".join(kernel_text(f"lib/{name}.cl") for name in BEFORE_MODEL if name in variant.library)
        + f'#line 1 "kernels/models/{variant.model.name}.cl"\n{variant.model.kernel()}\n'
    )


def source_text(variant: Variant) -> str:
    """Return the whole source of a variant."""
    library = "".join(
        philox_text() if name == "philox" else kernel_text(f"lib/{name}.cl")
        for name in variant.library
        if name not in BEFORE_MODEL
    )
    return model_text(variant) + library + only(kernel_text(f"{variant.job}.cl"), variant.parts)


@cache
def build(device: Device, variant: Variant) -> cl.Program:
    """Build a variant for a device; kept for the life of the process, and by PyOpenCL on disk.

    Raises
    ------
    DeviceError
        The device has no fp64 and the variant needs it, or the compiler refuses the source.
    """
    import warnings

    import pyopencl as cl

    if variant.precision.dtype is np.float64 and not device.has_double:
        raise DeviceError(f"{device} does not compute in double precision; ask for precision 'single'")
    program = cl.Program(open_queue(device).context, source_text(variant))
    try:
        with warnings.catch_warnings():
            # PoCL reports each use of its cache as compiler output.
            warnings.simplefilter("ignore", cl.CompilerWarning)
            return program.build(options=BUILD_OPTIONS)
    except cl.RuntimeError as error:
        first = next(
            (line for line in str(error).splitlines() if "error" in line), str(error).splitlines()[0]
        )
        raise DeviceError(
            f"{device} could not build {variant.job} for {variant.model.name}: {first}"
        ) from error


def upload(device: Device, values: np.ndarray, dtype: type[np.generic] | None = None) -> cl.Buffer:
    """Copy an array to a device, read-only there, in another type where one is named."""
    import pyopencl as cl

    with np.errstate(over="ignore"):  # what fp32 cannot hold becomes infinite, and its results are seen to
        host = np.ascontiguousarray(values, dtype=dtype)
    if host.size == 0:  # a model without features: a buffer needs a value, which nobody reads
        host = np.zeros(1, dtype=host.dtype)
    flags = cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR
    return cl.Buffer(open_queue(device).context, flags, hostbuf=host)


def work_group(device: Device, dimensions: int) -> tuple[int, ...] | None:
    """Return the work-group size for kernels whose items are long, such as a chain or a polish.

    One item on a CPU: left to itself PoCL chooses a size by the global one, and compiles the kernel again for
    each. On a GPU the driver chooses.
    """
    return None if device.kind == "gpu" else (1,) * dimensions
