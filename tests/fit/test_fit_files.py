"""Fit files: what an earlier version wrote opens, and a fit pickles and copies as it is."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path

import numpy as np
import pytest

from clbrdf import Fit, InputError
from clbrdf.fit.records import Setup
from clbrdf.fit.remarks import Remark

EARLIER = Path(__file__).parent / "files" / "version_0_1.h5"
"""ggx+lambert with alpha held off its value by a limit, rho fixed, weights relative, rtol 1e-9, the last
wavelength masked; written by version 0.1.0."""


@pytest.fixture(scope="module")
def earlier():
    return Fit.open(EARLIER)


def test_a_file_of_an_earlier_version_opens(earlier):
    assert earlier.status.tolist() == ["not converged", "not converged", "no data"]
    assert earlier.setup.weighting == "relative"
    assert (earlier.setup.rtol, earlier.setup.smooth, earlier.setup.left_out) == (1e-9, None, 0)
    assert earlier.given == ("lambert.rho",)
    assert earlier.estimate.at_bound.tolist() == [[True, False, False, False]] * 2 + [[False] * 4]
    assert not earlier.estimate.undetermined.any()
    held = Remark("at bound", ("ggx.alpha",), (0.25,))
    assert held in earlier.remarks[0]


def test_what_it_holds_is_kept_when_it_is_saved_anew(earlier, tmp_path):
    earlier.save(tmp_path / "fit.h5")
    _same(Fit.open(tmp_path / "fit.h5"), earlier)


def test_smooth_and_directions_left_out_are_read_from_the_provenance_of_earlier_files(tmp_path):
    import h5py

    path = tmp_path / "fit.h5"
    path.write_bytes(EARLIER.read_bytes())
    with h5py.File(path, "r+") as file:
        provenance = file["entry/fit/provenance"]
        provenance.attrs["smooth"] = "0.01"
        provenance.attrs["left_out"] = "12 of 60 directions, those of transmission"
    assert (Fit.open(path).setup.smooth, Fit.open(path).setup.left_out) == (0.01, 12)


@pytest.mark.parametrize("wrong", [np.inf, np.nan, -1.0])
def test_weights_that_are_none_are_refused(tmp_path, wrong):
    import h5py

    path = tmp_path / "fit.h5"
    path.write_bytes(EARLIER.read_bytes())
    with h5py.File(path, "r+") as file:
        weights = file["entry/fit/weights"]
        weights[3, 0] = wrong
    with pytest.raises(InputError, match=r"fit\.h5: .*weights holds what is no weight"):
        Fit.open(path)


@pytest.mark.parametrize("way", [copy.copy, copy.deepcopy, lambda fit: pickle.loads(pickle.dumps(fit))])
def test_copies_are_the_same_and_cannot_be_written(earlier, way):
    again = way(earlier)
    _same(again, earlier)
    for values in (again.vector, again.parameters["ggx.F0"], again.setup.weights, again.scan.brdf):
        with pytest.raises(ValueError, match="read-only"):
            values[0] = 1.0
    with pytest.raises(TypeError):
        again.setup.fixed["lambert.rho"] = 1.0


def test_records_do_not_change():
    setup = Setup(np.ones((2, 1)), "none", np.zeros((1, 2)), fixed={"n": np.ones(1)})
    with pytest.raises(AttributeError):
        setup.seed = 3
    with pytest.raises(ValueError, match="read-only"):
        setup.fixed["n"][0] = 2.0


def _same(one, other):
    assert one.model.name == other.model.name
    assert one.status.tolist() == other.status.tolist()
    assert one.remarks == other.remarks
    assert dict(one.provenance) == dict(other.provenance)
    for record in ("setup", "estimate", "goodness", "search"):
        a, b = vars(getattr(one, record)), vars(getattr(other, record))
        assert a.keys() == b.keys()
        for name, value in a.items():
            if name == "fixed":
                assert value.keys() == b[name].keys()
            elif isinstance(value, np.ndarray):
                np.testing.assert_array_equal(value, b[name])
            elif value == value:
                assert value == b[name], name
