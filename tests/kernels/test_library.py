"""The kernels' own arithmetic: exp2 against mpmath, Philox against its published vectors."""

from __future__ import annotations

import numpy as np
import pyopencl as cl
import pytest
from mpmath import mp, mpf, power

from clbrdf.models import get_model
from clbrdf.opencl.device import open_queue
from clbrdf.opencl.lanes import Lanes, safe_lanes
from clbrdf.opencl.precision import get_precision
from clbrdf.opencl.program import (
    ARITHMETIC,
    BUILD_OPTIONS,
    Variant,
    constants_text,
    kernel_text,
    philox_text,
    upload,
)

EXP2_JOB = """
kernel void job(global const real *x, global real *y) {
    STORE(exp2_lanes(LOAD(get_global_id(0), x)), get_global_id(0), y);
}
"""


def exp2_on(device, precision, width, x):
    variant = Variant("none", get_model(), get_precision(precision), Lanes(width, 1))
    text = constants_text(variant) + kernel_text("lib/vector.cl") + kernel_text("lib/exp2.cl") + EXP2_JOB
    queue, dtype = open_queue(device), get_precision(precision).dtype
    program = cl.Program(queue.context, text).build(options=["-cl-no-signed-zeros", "-cl-mad-enable"])
    out = np.empty(len(x), dtype)
    result = cl.Buffer(queue.context, cl.mem_flags.WRITE_ONLY, out.nbytes)
    cl.Kernel(program, "job")(queue, (len(x) // width,), None, upload(device, x, dtype), result)
    cl.enqueue_copy(queue, out, result)
    return out


@pytest.mark.filterwarnings("ignore::pyopencl.CompilerWarning")  # PoCL's cache speaks as the compiler
@pytest.mark.parametrize(
    ("precision", "low", "high", "bound"),
    # The bounds that kernels/lib/exp2.cl states.
    [
        ("fast:3", -126.0, 127.9, 1.1e-4),
        ("fast:4", -126.0, 127.9, 3.1e-6),
        ("fast:5", -126.0, 127.9, 2.2e-7),
        ("single", -126.0, 127.9, 1.6e-7),
        ("double", -1022.0, 1023.9, 3.8e-15),
    ],
)
def test_exp2_keeps_its_stated_error(device, precision, low, high, bound):
    dtype = get_precision(precision).dtype
    rng = np.random.default_rng(5)
    x = np.concatenate([rng.uniform(low, high, 3000), rng.uniform(-1, 1, 1000), np.arange(-40.0, 40.0, 0.5)])
    x = x.astype(dtype)[: len(x) // 8 * 8]
    for width in {1, safe_lanes(device, dtype).width}:
        y = exp2_on(device, precision, width, x)
        errors = [abs(mpf(float(b)) / power(2, mpf(float(a))) - 1) for a, b in zip(x, y, strict=True)]
        assert float(max(errors)) <= bound


@pytest.mark.filterwarnings("ignore::pyopencl.CompilerWarning")
@pytest.mark.parametrize("precision", ["single", "double"])
def test_exp2_beyond_its_range_is_zero_or_infinite_and_between_is_tiny(device, precision):
    smallest = {"single": -126.0, "double": -1022.0}[precision]
    largest = {"single": 128.0, "double": 1024.0}[precision]
    dtype = get_precision(precision).dtype
    x = np.array([-1e6, -2e4, smallest - 1.0, smallest - 0.3, 0.0, 1.0, largest, 1e6], dtype)
    y = exp2_on(device, precision, safe_lanes(device, dtype).width, x)
    assert y[:3].tolist() == [0.0, 0.0, 0.0]
    assert 0.0 <= y[3] < 2.0**smallest
    assert y[4:6].tolist() == [1.0, 2.0]
    assert np.isposinf(y[6:]).all()


PHILOX_JOB = """
kernel void job(global const uint *in, global uint *out) {
    philox4x32_ctr_t c = {{in[0], in[1], in[2], in[3]}};
    philox4x32_key_t k = {{in[4], in[5]}};
    philox4x32_ctr_t r = philox4x32(c, k);
    for (int j = 0; j < 4; ++j) out[j] = r.v[j];
}
"""


@pytest.mark.filterwarnings("ignore::pyopencl.CompilerWarning")
@pytest.mark.parametrize(
    ("counter_and_key", "words"),
    # Known-answer vectors of philox 4x32-10, published with Random123 (file kat_vectors).
    [
        ([0] * 6, [0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8]),
        ([0xFFFFFFFF] * 6, [0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD]),
        (
            [0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344, 0xA4093822, 0x299F31D0],
            [0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1],
        ),
    ],
)
def test_philox_gives_its_published_words(device, counter_and_key, words):
    queue = open_queue(device)
    program = cl.Program(queue.context, philox_text() + PHILOX_JOB).build()
    out = np.empty(4, np.uint32)
    result = cl.Buffer(queue.context, cl.mem_flags.WRITE_ONLY, out.nbytes)
    cl.Kernel(program, "job")(queue, (1,), None, upload(device, np.array(counter_and_key, np.uint32)), result)
    cl.enqueue_copy(queue, out, result)
    assert out.tolist() == words


def on_lanes(device, precision, width, x, call):
    """Values of a function of kernels/lib, in lanes."""
    variant = Variant("none", get_model(), get_precision(precision), Lanes(width, 1))
    job = EXP2_JOB.replace("exp2_lanes", call)
    text = constants_text(variant) + "".join(kernel_text(f"lib/{name}.cl") for name in ARITHMETIC) + job
    queue, dtype = open_queue(device), get_precision(precision).dtype
    program = cl.Program(queue.context, text).build(options=BUILD_OPTIONS)
    out = np.empty(len(x), dtype)
    result = cl.Buffer(queue.context, cl.mem_flags.WRITE_ONLY, out.nbytes)
    cl.Kernel(program, "job")(queue, (len(x) // width,), None, upload(device, x, dtype), result)
    cl.enqueue_copy(queue, out, result)
    return out


def scaled_erfc(x):
    return mp.exp(x * x) * mp.erfc(x)


@pytest.mark.filterwarnings("ignore::pyopencl.CompilerWarning")
@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize(
    ("call", "exact", "low", "high", "ulp"),
    # Bounds in units of 2^-24 and 2^-53: those that the files state.
    [
        ("sqrt_lanes", mp.sqrt, -30, 30, 1.01),
        ("log_lanes", mp.log, -30, 30, 4),
        ("log1p_lanes", mp.log1p, -30, 30, 4),
        ("erfcx_lanes", scaled_erfc, -6, 6, 10),
    ],
)
def test_functions_keep_their_stated_error(device, precision, call, exact, low, high, ulp):
    dtype = get_precision(precision).dtype
    rng = np.random.default_rng(6)
    x = np.concatenate([10.0 ** rng.uniform(low, high, 2000), rng.uniform(0.3, 3.0, 1000)]).astype(dtype)
    unit = 2.0**-24 if dtype is np.float32 else 2.0**-53
    with mp.workdps(40):
        right = [exact(mpf(float(a))) for a in x]
        for width in {1, safe_lanes(device, dtype).width}:
            y = on_lanes(device, precision, width, x, call)
            # About 1 a logarithm is right to half a unit of 1 only: it is small there.
            size = [max(abs(b), mpf(0.25) if call == "log_lanes" else 0) for b in right]
            errors = [abs(mpf(float(a)) - b) / s for a, b, s in zip(y, right, size, strict=True)]
            if call == "sqrt_lanes" and device.kind == "gpu" and precision == "single":
                ulp = 6.0
            assert float(max(errors)) <= ulp * unit
