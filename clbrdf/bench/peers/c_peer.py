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
from clbrdf.models import Model
from clbrdf.models.kernel import opencl_text

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
    single = dtype is np.float32
    by_hand = problem.model.name == "wang2013"
    source = _packaged("objective.c") if by_hand else model_source(problem.model, single)
    library = _built(source, folder / f"{problem.model.name}_{dtype.__name__}")
    if library is None:
        return None
    name = f"objective_{'single' if single else 'double'}" if by_hand else "objective"
    columns = np.ascontiguousarray(problem.features.T, dtype=dtype)
    data = [np.ascontiguousarray(a, dtype=dtype) for a in (problem.target[0], problem.scale[0])]
    typed, out = np.ascontiguousarray(sets, dtype=dtype), np.empty(len(sets), dtype=dtype)
    starts = problem.starts

    def pointer(array: npt.NDArray[np.generic]) -> ctypes.c_void_p:
        return array.ctypes.data_as(ctypes.c_void_p)

    features = [pointer(column) for column in columns]
    if not by_hand:
        features = [pointer(columns), ctypes.c_size_t(columns.shape[1])]  # type: ignore[list-item]
    function = getattr(library, name)
    sizes = [ctypes.c_size_t(len(sets)), ctypes.c_size_t(len(starts) - 1)]
    arguments = [*sizes, pointer(starts), pointer(typed), *features, *map(pointer, data), pointer(out)]

    def run() -> npt.NDArray[np.floating]:
        function(*arguments)
        return out

    return run


def model_source(model: Model, single: bool) -> str:
    """Return the C source of a model's objective: the formula as its page forms it, in plain loops."""
    names = model.feature_names
    table = [f"#define P {len(model.parameters)}"]
    table += [f"#define P_{row.symbol} {j}" for j, row in enumerate(model.parameters)]
    fields = ", ".join(names) or "none"
    loads = ", ".join(f"features[{j} * directions + n]" for j in range(len(names))) or "0"
    table += [
        f"typedef struct {{ REAL {fields}; }} geometry;",
        "inline geometry geometry_at(const REAL *restrict features, size_t directions, size_t n) {",
        f"    return (geometry){{{loads}}};",
        "}",
    ]
    # Only what E needs; derivatives and terms are other functions.
    whole = opencl_text(model.formula, model.parameters, model.title, plain=True)
    functions = whole.split("// What the linear parameters")[0].split("// f, and ∂f")[0]
    head = "#define REAL float\n#define SINGLE\n" if single else "#define REAL double\n"
    text = _packaged("model.c").replace("/* TABLE */", "\n".join(table)).replace("/* MODEL */", functions)
    return head + text


def _packaged(name: str) -> str:
    return resources.files("clbrdf.bench.peers").joinpath(name).read_text(encoding="utf-8")


def _built(text: str, stem: Path) -> ctypes.CDLL | None:
    """Return the library of a source, built beside the path's stem; None where it cannot be built."""
    compiler = find_compiler()
    if compiler is None:
        return None
    source, compiled, library = (stem.with_suffix(end) for end in (".c", ".o", ".so"))
    source.write_text(text, encoding="utf-8")
    for words in (
        [compiler, *COMPILE, str(source), "-o", str(compiled)],
        [compiler, *LINK, str(compiled), "-o", str(library), "-lm"],
    ):
        if subprocess.run(words, capture_output=True, check=False).returncode != 0:
            return None
    return ctypes.CDLL(str(library))
