"""The benchmark compares like with like: every contender computes the same E."""

from __future__ import annotations

import json

import numpy as np
import pytest

from clbrdf.bench import throughput
from clbrdf.bench.peers.c_peer import c_objective, find_compiler
from clbrdf.bench.peers.numba_peer import numba_objective
from clbrdf.bench.peers.numpy_peer import numpy_objective
from clbrdf.bench.workload import workload
from clbrdf.cli import main
from clbrdf.fit.objectives import batch_objective
from clbrdf.opencl.precision import PRECISIONS, get_precision


@pytest.fixture(scope="module")
def work(device):
    problem, sets = workload(device, sets=64)
    values = problem.model.brdf(sets[0][:, None, :], problem.features)
    return problem, sets, ((problem.scale * values - problem.target) ** 2).sum(axis=1)


# Exponents up to 300 log2 units in 24 bits: 1.2e-5 of each value; the degree of exp2 adds its own.
TOLERANCES = {"fast:3": 2e-2, "fast:4": 1e-3, "fast:5": 1e-4, "fast:6": 1e-4, "single": 1e-4, "double": 1e-11}


@pytest.mark.parametrize("name", PRECISIONS)
def test_our_kernels(work, name):
    problem, sets, reference = work
    ours = batch_objective(problem, sets, get_precision(name))
    np.testing.assert_allclose(ours[0], reference, rtol=TOLERANCES[name])


@pytest.mark.parametrize(("dtype", "tolerance"), [(np.float32, 1e-4), (np.float64, 1e-11)])
def test_peers(work, dtype, tolerance, tmp_path):
    problem, sets, reference = work
    np.testing.assert_allclose(numpy_objective(problem, sets[0], dtype)(), reference, rtol=tolerance)
    if find_compiler() is not None:
        np.testing.assert_allclose(
            c_objective(problem, sets[0], dtype, tmp_path)(), reference, rtol=tolerance
        )
        assert np.nextafter(0.0, 1.0) * 1.0 > 0.0  # loading it has left subnormal numbers alone
    numba = numba_objective(problem, sets[0], dtype)
    if numba is not None:
        np.testing.assert_allclose(numba(), reference, rtol=tolerance)


def test_a_race_is_interleaved():
    order = []
    rows = [throughput.Contender(name, "fp32", 1, lambda name=name: order.append(name)) for name in "ab"]
    ended = throughput.race(rows, rounds=3)
    # In every round once to wake the cores, which builds the first time, and once for the time.
    assert order == ["a", "a", "b", "b"] * 3
    assert [len(row.seconds) for row in ended] == [3, 3]


def test_the_table_and_the_file(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(throughput, "ROUNDS", 2)
    monkeypatch.setenv("COLUMNS", "100")
    assert main(["bench", "throughput", "--json", str(tmp_path / "bench.json")]) == 0
    out = capsys.readouterr().out
    assert max(len(line) for line in out.splitlines()) <= 100
    content = json.loads((tmp_path / "bench.json").read_text())
    names = [row["name"] for row in content["throughput"]]
    assert any(name.startswith("OpenCL single") for name in names)
    assert "NumPy, one thread" in names
    assert content["start"]["cold"] > content["start"]["launch"] > 0.0
