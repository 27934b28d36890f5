"""Kernel functions by themselves: gradients of every model, and arithmetic on pairs."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pyopencl as cl
import pytest

from clbrdf import Directions
from clbrdf.models import get_model, model_names
from clbrdf.opencl.device import open_queue
from clbrdf.opencl.lanes import Lanes, safe_lanes
from clbrdf.opencl.precision import get_precision
from clbrdf.opencl.program import BUILD_OPTIONS, Variant, constants_text, kernel_text, model_text, upload

pytestmark = pytest.mark.filterwarnings("ignore::pyopencl.CompilerWarning")  # PoCL's cache speaks up

GRADIENT_JOB = """
kernel void job(global const real *rows, global const real *parameters, global real *out) {
    realv p[P], tangent[TANGENTS], factor[P];
    for (int j = 0; j < P; ++j) p[j] = LOAD(j, parameters);
    model_state m = model_prepare(p);
    const geometry x = geometry_of(rows, get_global_id(0));
    model_incident(&m, x);
    const realv f = model_tangents(&m, x, tangent);
    model_factors(&m, factor);
    const size_t place = get_global_id(0) * (P + 1);
    for (int j = 0; j < P; ++j) STORE(factor[j] * tangent[tangent_of[j]], place + j, out);
    STORE(f, place + P, out);
}
"""


def run(device, text, size, out, *inputs):
    queue = open_queue(device)
    program = cl.Program(queue.context, text).build(options=BUILD_OPTIONS)
    result = cl.Buffer(queue.context, cl.mem_flags.WRITE_ONLY, out.nbytes)
    cl.Kernel(program, "job")(queue, (size,), None, *(upload(device, a) for a in inputs), result)
    cl.enqueue_copy(queue, out, result)
    return out


@pytest.mark.parametrize("name", model_names())
def test_gradient_of_the_kernel_is_the_jacobian_of_the_reference(device, name):
    model, rng = get_model(name), np.random.default_rng(12)
    lanes = safe_lanes(device, np.float64)
    variant = Variant("none", model, get_precision("double"), lanes)
    text = model_text(variant) + GRADIENT_JOB
    n = 200
    directions = Directions.relative(rng.uniform(0, 85, n), rng.uniform(0, 85, n), rng.uniform(0, 360, n))
    x = model.features(directions)
    sets = model.defaults[None, :] * rng.uniform(0.7, 1.3, (lanes.width, len(model.names)))
    out = np.empty((n, len(model.names) + 1, lanes.width))
    run(device, text, n, out, x, sets.T)
    for lane in range(lanes.width):
        # Both sides are good to 1e-12; derivatives that underflow may differ in the last octave.
        expected = model.jacobian(sets[lane][None, :], x)
        np.testing.assert_allclose(out[:, :-1, lane], expected, rtol=1e-11, atol=1e-290)
        np.testing.assert_allclose(
            out[:, -1, lane], model.brdf(sets[lane][None, :], x), rtol=1e-11, atol=1e-290
        )


PAIR_JOB = """
kernel void job(global const real *in, global real *out) {
    const size_t k = get_global_id(0);
    pair a, b;
    a.hi = in[4 * k]; a.lo = in[4 * k + 1]; b.hi = in[4 * k + 2]; b.lo = in[4 * k + 3];
    const pair sum = pair_sum(a, b), product = pair_product(a, b);
    out[4 * k] = sum.hi; out[4 * k + 1] = sum.lo;
    out[4 * k + 2] = product.hi; out[4 * k + 3] = product.lo;
}
"""


def test_pairs_carry_twice_the_digits(device):
    variant = Variant("none", get_model(), get_precision("single"), Lanes(1, 1), ("pair",))
    text = constants_text(variant) + kernel_text("lib/vector.cl") + kernel_text("lib/exp2.cl")
    text += kernel_text("lib/pair.cl") + PAIR_JOB
    rng = np.random.default_rng(13)
    exact = rng.standard_normal((500, 2)) * 10.0 ** rng.uniform(-3, 3, (500, 2))
    high = exact.astype(np.float32)
    low = (exact - high).astype(np.float32)
    pairs = np.stack([high[:, 0], low[:, 0], high[:, 1], low[:, 1]], axis=1)
    out = run(device, text, 500, np.empty((500, 4), np.float32), pairs)
    for (a1, a2, b1, b2), (s1, s2, p1, p2) in zip(pairs.tolist(), out.tolist(), strict=True):
        a, b = Fraction(a1) + Fraction(a2), Fraction(b1) + Fraction(b2)
        # The sum is good relative to its larger term: cancellation may show the last bits of the inputs.
        largest = max(abs(a), abs(b))
        assert abs(Fraction(s1) + Fraction(s2) - (a + b)) <= largest * Fraction(2) ** -44
        assert abs(Fraction(p1) + Fraction(p2) - a * b) <= abs(a * b) * Fraction(2) ** -34
