"""OpenCL programs: sources joined in Python, built once per device and variant.

The text of a program is: constants of the variant (precision, lanes, the model's parameter and feature
names), vectors, exp2 and directions, the model, the library files a job asks for, the job. Nothing is
left to the compiler's include path, which breaks on folders with a space; `#line` markers keep the file
names in messages.

What is not asked for is not in the text: a line that ends in `//@name` stays only where the name is a term
that the model has, or a part of the job that the variant asks for; lines from `//@{` to `//@}` stay where the
model is whole.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING

import numpy as np

from clbrdf.device import Device, open_queue
from clbrdf.errors import DeviceError
from clbrdf.lanes import Lanes, lanes_of
from clbrdf.models import Model
from clbrdf.models.model import LOG2_OF_ZERO
from clbrdf.precision import Precision

if TYPE_CHECKING:
    import pyopencl as cl

# -cl-fast-relaxed-math is never used: it deletes the rounding in exp2. Signed zeros carry nothing here.
BUILD_OPTIONS = ["-cl-std=CL1.2", "-cl-no-signed-zeros", "-cl-mad-enable"]


@dataclass(frozen=True)
class Variant:
    """What a program is built for: job file, model, precision, lanes, library files, parts of the job.

    The library file "pair" comes before the model and makes it careful; the others come after it.
    """

    job: str
    model: Model
    precision: Precision
    lanes: Lanes
    library: tuple[str, ...] = ()
    parts: tuple[str, ...] = ()

    @classmethod
    def on(
        cls,
        device: Device,
        job: str,
        model: Model,
        precision: Precision,
        library: tuple[str, ...] = (),
        parts: tuple[str, ...] = (),
    ) -> Variant:
        """Return the variant with the lanes that suit a device."""
        return cls(job, model, precision, lanes_of(device, precision.dtype), library, parts)


def kernel_text(path: str) -> str:
    """Return a file of the kernels folder behind a `#line` marker."""
    text = resources.files("clbrdf.kernels").joinpath(path).read_text(encoding="utf-8")
    return f'#line 1 "kernels/{path}"\n{text}\n'


def only(text: str, wanted: Collection[str], whole: bool = True) -> str:
    """Return a kernel text without the lines marked by names that are not wanted; line numbers stay.

    Lines from `//@{` to `//@}` stay where the model is whole.
    """
    lines, inside = [], False
    for line in text.split("\n"):
        code, marker, name = line.partition("//@")
        if marker and name in "{}":
            inside, line = name == "{", ""
        elif marker:
            line = code.rstrip() if name in wanted else ""
        lines.append("" if inside and not whole else line)
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
    """Return the macros and the geometry record that follow from precision, lanes and model table."""
    model = variant.model
    names = [p.name.upper() for p in model.parameters]
    kind = "double" if variant.precision.dtype is np.float64 else "float"
    lines = [f"#define REAL {kind}", f"#define WIDTH {variant.lanes.width}"]
    lines += [f"#define UNROLL {variant.lanes.unroll}", f"#define EXP2_DEGREE {variant.precision.degree}"]
    if kind == "double":
        lines.append("#define REAL_IS_DOUBLE")
    if "pair" in variant.library:
        lines.append("#define CAREFUL")
    lines.append(f"#define LOG2_OF_ZERO {LOG2_OF_ZERO:.1f}{'' if kind == 'double' else 'f'}")
    lines += [f"#define P {len(names)}", f"#define F {len(model.feature_names)}"]
    lines += [f"#define {name} {j}" for j, name in enumerate(names)]
    on_log = ", ".join("1" if p.scale == "log" else "0" for p in model.parameters)
    signs = ", ".join(f"{p.sign:.0f}" for p in model.parameters)
    lines += [
        f"constant int on_log_scale[P] = {{{on_log}}};",
        f"constant int sign_of[P] = {{{signs}}};",
    ]
    # Without a structure nothing is solved, and the places are not used.
    linear = [] if model.structure is None else model.places(model.structure.linear)
    searched = [j for j in range(len(names)) if j not in linear]
    for name, places in (("linear_place", linear or [0]), ("searched_place", searched)):
        lines.append(f"constant int {name}[] = {{{', '.join(map(str, places))}}};")
    return "\n".join(lines) + "\n"


def geometry_text(model: Model) -> str:
    """Return the record of a direction, that of geometry features, and the two ways to load the latter."""
    fields = ", ".join(model.feature_names) or "none"
    lanes = "\n".join(
        f"    x.{name} = LOAD(group, rows + {j} * n_padded);" for j, name in enumerate(model.feature_names)
    )
    start = "" if model.feature_names else " = {(realv)0}"
    same = "\n".join(f"    x.{name} = (realv)row[n * F + {j}];" for j, name in enumerate(model.feature_names))
    return (
        kernel_text("lib/direction.cl") + f"typedef struct {{ realv {fields}; }} geometry;\n"
        "inline geometry geometry_lanes(global const real *rows, ulong n_padded, size_t group) {\n"
        f"    geometry x{start};\n{lanes}\n    return x;\n}}\n"
        "inline geometry geometry_of(global const real *row, size_t n) {\n"
        f"    geometry x{start};\n{same}\n    return x;\n}}\n"
    )


def source_text(variant: Variant) -> str:
    """Return the whole source of a variant."""
    model = variant.model
    terms = [term.name for term in model.terms]
    library = "".join(
        philox_text() if name == "philox" else kernel_text(f"lib/{name}.cl")
        for name in variant.library
        if name != "pair"
    )
    return (
        constants_text(variant)
        + kernel_text("lib/vector.cl")
        + kernel_text("lib/exp2.cl")
        + geometry_text(variant.model)
        + (kernel_text("lib/pair.cl") if "pair" in variant.library else "")
        + only(kernel_text(f"models/{model.name}.cl"), terms, not model.left_out)
        + library
        + only(kernel_text(f"{variant.job}.cl"), variant.parts)
    )


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
    flags = cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR
    return cl.Buffer(open_queue(device).context, flags, hostbuf=host)


def work_group(device: Device, dimensions: int) -> tuple[int, ...] | None:
    """Return the work-group size for kernels whose items are long, such as a chain or a polish.

    One item on a CPU: left to itself PoCL chooses a size by the global one, and compiles the kernel again for
    each. On a GPU the driver chooses.
    """
    return None if device.kind == "gpu" else (1,) * dimensions
