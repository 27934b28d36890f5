"""What the data leave open is said where it is so and only there; words are made of it at the end."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import clbrdf
from clbrdf import Fit, Scan
from clbrdf.fit.remarks import KINDS, Remark
from clbrdf.fit.words import WORDS, gathered, remark_words, remarks_line
from tests.reference import naive


def scan_of(angles, parameters=naive.TIN_FOIL, noise=0.02, views=43):
    theta_r = np.linspace(0.0, 84.0, views)
    theta_i, theta_r = np.repeat(angles, views), np.tile(theta_r, len(angles))
    truth = naive.brdf(parameters, theta_i, theta_r, 180.0)[:, None] * np.ones(2)
    draws = np.random.default_rng(41).standard_normal(truth.shape)
    return Scan(theta_i, 0.0, theta_r, 180.0, [500.0, 600.0], truth * (1.0 + noise * draws))


def kinds(fit, k):
    return [remark.kind for remark in fit.remarks[k]]


@pytest.mark.parametrize(
    ("angles", "words"), [((45.0,), "1 incident angle,"), ((30.0, 60.0), "2 incident angles,")]
)
def test_few_incident_angles(angles, words):
    fit = clbrdf.fit(scan_of(angles))
    for remarks, condition in zip(fit.remarks, fit.estimate.condition, strict=True):
        remark = remarks[0]
        assert (remark.kind, remark.numbers) == ("few angles", (len(angles), 3))
        assert words in remark_words(remark)
        # The valley of equal E may end at a limit, and what remains is determined there.
        assert condition == np.inf or any(r.kind == "at bound" for r in remarks)
    assert set(fit.status.tolist()) <= {"ambiguous", "at bound"}


def test_three_incident_angles_leave_nothing_open():
    fit = clbrdf.fit(scan_of((30.0, 45.0, 60.0)))
    assert fit.remarks == ((), ())
    assert np.isfinite(fit.estimate.condition).all()


def test_no_specular_part():
    lambert = (0.0, 0.5, -1.0, 1.0, 0.0, 1.0)
    fit = clbrdf.fit(scan_of((30.0, 45.0, 60.0), lambert, noise=0.0), bounds={"ks": (0.0, 1e-9)})
    assert all("no lobe" in kinds(fit, k) for k in range(2))


def test_fewer_values_than_parameters():
    scan = Scan([30.0] * 3, 0.0, [20.0, 30.0, 40.0], 180.0, [500.0], [[1.0], [2.0], [1.5]])
    fit = clbrdf.fit(scan)
    assert "3 values for 6 parameters" in remarks_line(fit.remarks[0])


def test_weights_of_zero_do_not_count_as_values():
    scan = scan_of((30.0, 45.0, 60.0))
    weights = np.zeros(len(scan.theta_i))
    weights[45] = 1.0
    assert "1 value for 6 parameters" in remarks_line(clbrdf.fit(scan, weights=weights).remarks[0])


def test_few_values_on_a_lobe_are_not_called_a_missing_lobe():
    scan = scan_of((45.0, 60.0), views=4)
    fit = clbrdf.fit(scan)
    assert not any("no lobe" in kinds(fit, k) for k in range(2))


def test_constant_data_have_no_specular_part():
    angles = np.arange(0.0, 80.0, 5.0)
    flat = Scan(np.full(16, 30.0), 0.0, angles, 180.0, [500.0], np.full((16, 1), 0.3))
    assert "no lobe" in kinds(clbrdf.fit(flat), 0)


def test_parameter_at_its_bound():
    fit = clbrdf.fit(scan_of((30.0, 45.0, 60.0)), bounds={"d": (0.9, 2.0)})
    assert all(Remark("at bound", ("d",), (0.9,)) in remarks for remarks in fit.remarks)


def test_correlations_and_condition_are_those_of_the_derivatives():
    fit = clbrdf.fit(scan_of((30.0, 45.0, 60.0)))
    x = fit.model.features(fit.scan.directions)
    for k in range(2):
        jacobian = fit.model.jacobian(fit.vector[k][None, :], x)
        covariance = np.linalg.inv(jacobian.T @ jacobian)
        deviation = np.sqrt(np.diag(covariance))
        # The condition number is near 30: 1e-9 leaves room for its square in the normal equations.
        np.testing.assert_allclose(
            fit.correlation[k], covariance / np.outer(deviation, deviation), rtol=1e-9, atol=1e-9
        )
        unit = jacobian / np.linalg.norm(jacobian, axis=0)
        assert fit.estimate.condition[k] == pytest.approx(np.linalg.cond(unit), rel=1e-9)


def test_remarks_are_kept_in_the_file_and_gathered(tmp_path):
    fit = clbrdf.fit(scan_of((45.0,)))
    fit.save(tmp_path / "fit.h5")
    again = Fit.open(tmp_path / "fit.h5")
    assert again.remarks == fit.remarks
    assert again.correlation.tobytes() == fit.correlation.tobytes()
    tied = [Remark("correlated", ("a", "b"), (value,)) for value in (0.9991, 0.9995)]
    found = gathered(((Remark("undetermined", ("c",)), tied[0]), (), (tied[1],)), np.array([1.0, 2.0, 3.0]))
    assert {text: nm.tolist() for text, nm in found} == {
        "a and b are hardly told apart: correlation 0.9991 to 0.9995": [1.0, 3.0],
        "c cannot be determined: other values fit as well": [1.0],
    }


def test_every_kind_has_words():
    assert set(WORDS) == set(KINDS)


def test_masked_directions_do_not_count_as_seen():
    scan = scan_of((30.0, 45.0, 60.0))
    flags = np.zeros(scan.brdf.shape, np.uint32)
    flags[scan.theta_i == 45.0, 0] = 1
    fit = clbrdf.fit(replace(scan, flags=flags))
    assert "2 incident angles" in remarks_line(fit.remarks[0])
    assert fit.remarks[1] == ()
