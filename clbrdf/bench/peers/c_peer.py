"""The objective in C, built with the machine's compiler for this processor; skipped where there is none."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable
from importlib import resources
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clbrdf.fit.problem import Problem

COMPILE = ("-O3", "-march=native", "-ffast-math", "-fopenmp", "-fPIC", "-c")
LINK = ("-shared", "-fopenmp")
"""Without -ffast-math: linked with it, the library would flush subnormal numbers in all of the process."""


def find_compiler() -> str | None:
    """Return the path of a C compiler, None where there is none."""
    return next((path for name in ("gcc", "cc", "clang") if (path := shutil.which(name))), None)


def c_objective(
    problem: Problem, sets: npt.NDArray[np.float64], dtype: type[np.floating], folder: Path
) -> Callable[[], npt.NDArray[np.floating]] | None:
    """Return a function that computes E of sets (K, P) in a type; None where it cannot be built."""
    compiler = find_compiler()
    if compiler is None:
        return None
    library = folder / "objective.so"
    if not library.exists():
        source = folder / "objective.c"
        packaged = resources.files("clbrdf.bench.peers").joinpath("objective.c")
        source.write_text(packaged.read_text(encoding="utf-8"), encoding="utf-8")
        compiled = folder / "objective.o"
        for words in (
            [compiler, *COMPILE, str(source), "-o", str(compiled)],
            [compiler, *LINK, str(compiled), "-o", str(library), "-lm"],
        ):
            if subprocess.run(words, capture_output=True, check=False).returncode != 0:
                return None
    function = getattr(
        ctypes.CDLL(str(library)), "objective_single" if dtype is np.float32 else "objective_double"
    )
    arrays = [
        np.ascontiguousarray(values, dtype=dtype)
        for values in (sets, *problem.features.T, problem.target[0], problem.scale[0])
    ]
    starts, out = problem.starts, np.empty(len(sets), dtype=dtype)
    sizes = [ctypes.c_size_t(len(sets)), ctypes.c_size_t(len(starts) - 1)]
    pointers = [array.ctypes.data_as(ctypes.c_void_p) for array in (starts, *arrays, out)]

    def run() -> npt.NDArray[np.floating]:
        function(*sizes, *pointers)
        return out

    return run
