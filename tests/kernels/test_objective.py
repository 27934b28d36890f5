"""E of every model on the device against its plain sum in NumPy; divisions that neighbours share."""

from __future__ import annotations

import numpy as np
import pytest

from clbrdf.bench.peers.c_peer import c_objective, find_compiler
from clbrdf.bench.workload import workload
from clbrdf.fit.objectives import batch_objective
from clbrdf.models import get_model, model_names
from clbrdf.opencl.lanes import Lanes
from clbrdf.opencl.precision import get_precision

HUGE = '''"""A quotient whose denominator times itself is beyond the range of numbers."""

from clbrdf.models import RECIPROCAL, linear, model, shape
from clbrdf.models.expression import named, sqrt


def value(g, scale, k):
    """Record the value."""
    large = named("large", SIZE * (1.0 + g.x))
    return scale * named("numerator", SIZE * g.cosines) / (large * (1.0 + sqrt(1.0 + k * g.tan2_h)))


MODEL = model(
    title="A quotient of SIZE",
    source="made up",
    parameters=[linear("scale", "1", 1.0, (0.0, 10.0), "size"), shape("k", "1", 1.0, (0.5, 2.0), "shape")],
    value=value,
    flags=RECIPROCAL,
)
'''


def plain(problem, sets):
    values = problem.model.brdf(sets[0][:, None, :], problem.features)
    return ((problem.scale * values - problem.target) ** 2).sum(axis=1)


@pytest.mark.parametrize("name", [*(n for n in model_names() if n != "rayleigh_rice"), "ggx+minnaert"])
def test_every_model(device, name):
    problem, sets = workload(device, sets=12, model=get_model(name))
    exact = plain(problem, sets)
    # 86 directions an incident angle: whole strides of 2 and 4, and what is left of them.
    for precision, tolerance in (("double", 1e-10), ("fast:6", 2e-3)):
        ours = batch_objective(problem, sets, get_precision(precision))
        np.testing.assert_allclose(ours[0], exact, rtol=tolerance)
    one_by_one = batch_objective(problem, sets, get_precision("double"), Lanes(1, 1))
    np.testing.assert_allclose(one_by_one[0], exact, rtol=1e-10)


@pytest.mark.parametrize("size", ["1e200", "1e-200"])
def test_a_shared_division_beyond_the_range_is_done_again(device, tmp_path, size):
    path = tmp_path / "quotient.py"
    path.write_text(HUGE.replace("SIZE", size), encoding="utf-8")
    model = get_model(str(path))
    assert "MODEL_DIVIDES" in model.kernel()
    problem, sets = workload(device, sets=12, model=model)
    ours = batch_objective(problem, sets, get_precision("double"))
    np.testing.assert_allclose(ours[0], plain(problem, sets), rtol=1e-10)


@pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
@pytest.mark.parametrize("name", ["ggx_dielectric", "rpv", "beckmann"])
def test_the_peer_in_c_computes_the_same(device, name, tmp_path):
    problem, sets = workload(device, sets=12, model=get_model(name))
    peer = c_objective(problem, sets[0], np.float64, tmp_path)
    np.testing.assert_allclose(peer(), plain(problem, sets), rtol=1e-9)
