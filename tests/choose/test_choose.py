"""The choice as a whole: what it fits, what it predicts, what it says, what it keeps."""

from __future__ import annotations

import pickle
from dataclasses import replace

import h5py
import numpy as np
import pytest

import clbrdf
from clbrdf import Choice, Fit, InputError, choose
from clbrdf.choose import DEFAULT_CANDIDATES, usual_weights
from clbrdf.choose.candidates import default_candidates
from tests.choose.made import MODELS, made


def test_the_truth_is_chosen(choice):
    assert choice.chosen == choice.fit.model.name == "ggx+lambert"
    assert choice.weights == "sigma"
    assert choice.fits
    assert choice.verdict == ""
    assert {row.model for row in choice.ranking} == set(MODELS)
    truth = choice.of("ggx+lambert")
    # 248 values less 8 parameters: standard deviation √(2/240) = 0.09.
    assert truth.chi2_reduced == pytest.approx(1.0, abs=0.36)
    assert abs(truth.lag_one) < 0.26  # 4 of 1/√240
    assert choice.of("lambert").lag_one > 0.5
    assert choice.of("lambert").chi2_reduced > 100.0


def test_the_ranking_is_in_order(choice):
    means = [float(row.score.mean()) for row in choice.ranking]
    assert means == sorted(means)
    for row, mean in zip(choice.ranking, means, strict=True):
        assert row.predicted == pytest.approx(np.sqrt(mean), rel=1e-12)
        assert row.above == pytest.approx(mean - means[0], rel=1e-9, abs=1e-15)
    assert choice.best is choice.ranking[0]
    assert choice.steady == ("ggx+lambert",) * 4


def test_what_is_left_out_is_predicted_by_the_usual_fit(choice, made_scan):
    # Written out once more: fit without 35°, predict 35°, E of (13) scaled to a mean.
    here = made_scan.theta_i == 35.0
    fit = clbrdf.fit(made_scan.rows(~here), model="beckmann+lambert", weights="sigma")
    predicted = fit.evaluate(made_scan.directions[here])
    g = made_scan.sigma**-2.0
    share = (g * made_scan.brdf**2).mean(axis=0)
    expected = (g[here] * (predicted - made_scan.brdf[here]) ** 2).mean(axis=0) / share
    np.testing.assert_allclose(choice.of("beckmann+lambert").score[1], expected, rtol=1e-9)


def test_a_left_out_angle_is_not_seen(made_scan, choice):
    # Values of one incident angle may be anything: the predictions of it stay the same, to the last bit.
    here = made_scan.theta_i == 70.0
    spoiled = replace(made_scan, brdf=np.where(here[:, None], 3.0 * made_scan.brdf, made_scan.brdf))
    fit = clbrdf.fit(spoiled.rows(~here), model="ggx+lambert", weights="sigma")
    same = clbrdf.fit(made_scan.rows(~here), model="ggx+lambert", weights="sigma")
    np.testing.assert_array_equal(fit.vector, same.vector)


def test_the_whole_fit_is_the_usual_fit(choice, made_scan):
    usual = clbrdf.fit(made_scan, model="ggx+lambert", weights="sigma")
    np.testing.assert_array_equal(choice.fit.vector, usual.vector)
    np.testing.assert_allclose(choice.values("ggx+lambert"), usual.evaluate(), rtol=1e-12)


def test_a_smooth_error_is_said_to_be_no_fit():
    def bent(theta_i, signed):
        return 1.0 + 0.1 * np.cos(np.deg2rad(3.0 * signed)) + 0.002 * (theta_i - 40.0)

    choice = choose(made(factor=bent), MODELS)
    assert not choice.fits
    assert choice.verdict.startswith("no model fits: even the best leaves a reduced chi-squared of ")
    assert choice.misfit
    assert all("θi = " in text for text in choice.misfit)
    assert any("above" in text or "below" in text for text in choice.misfit)


def test_saved_and_opened(choice, tmp_path):
    path = tmp_path / "fit.h5"
    choice.save(path)
    assert Choice.is_in(path)
    again = Choice.open(path)
    for name in ("chosen", "verdict", "misfit", "skipped", "thin", "weights", "steady"):
        assert getattr(again, name) == getattr(choice, name)
    np.testing.assert_array_equal(again.places, choice.places)
    for one, other in zip(again.ranking, choice.ranking, strict=True):
        assert np.isnan(one.milliseconds)
        assert dict(one.parameters).keys() == dict(other.parameters).keys()
        np.testing.assert_array_equal(again.values(one.model), choice.values(one.model))
        for name in ("score", "mean_residual", "free", "within", "aicc", "bic", "lag_one", "exchange", "cut"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    # It is a fit like any other.
    np.testing.assert_array_equal(Fit.open(path).vector, choice.fit.vector)
    with pytest.raises(InputError, match="exists already"):
        choice.save(path)
    choice.save(tmp_path / "again.h5")
    assert (tmp_path / "again.h5").read_bytes() == path.read_bytes()
    with h5py.File(path) as file:
        assert file["entry/choice"].attrs["NX_class"] == "NXprocess"


def test_a_plain_fit_has_no_ranking(choice, tmp_path):
    choice.fit.save(tmp_path / "plain.h5")
    assert not Choice.is_in(tmp_path / "plain.h5")
    with pytest.raises(InputError, match="holds a fit and no ranking of models"):
        Choice.open(tmp_path / "plain.h5")


def test_nothing_in_it_can_be_changed(choice):
    with pytest.raises(ValueError, match="read-only"):
        choice.best.score[0, 0] = 1.0
    with pytest.raises(TypeError):
        choice.best.parameters["ggx.alpha"] = 1.0
    with pytest.raises(AttributeError):
        choice.chosen = "eon"


def test_a_ranking_may_be_made_at_some_wavelengths(made_scan):
    scan = made(wavelengths=tuple(np.linspace(400.0, 700.0, 7)))
    some = choose(scan, ["lambert", "minnaert"], wavelengths=3)
    assert some.places.tolist() == [0, 3, 6]
    assert some.best.score.shape == (4, 3)
    assert some.fit.vector.shape[0] == 7
    assert np.isfinite(some.fit.objective).all()
    assert choose(scan, ["lambert"], wavelengths=None).best.score.shape == (4, 7)


def test_weights_of_directions_go_with_them(made_scan):
    weights = np.where(made_scan.theta_r > made_scan.theta_i + 20.0, 0.0, 1.0)
    found = choose(made_scan, ["minnaert", "lambert"], weights=weights)
    assert found.weights == "user"
    reduced = choose(made_scan.rows(weights > 0.0), ["minnaert", "lambert"], weights="none")
    for one, other in zip(found.ranking, reduced.ranking, strict=True):
        # Angles of weight 0 do not count, neither in a fit nor in a score.
        np.testing.assert_allclose(one.score, other.score, rtol=1e-6)


def test_usual_weights_are_said(made_scan):
    assert usual_weights(made_scan) == "sigma"
    assert usual_weights(replace(made_scan, sigma=None)) == "relative"
    some = np.array(made_scan.sigma)
    some[3, 0] = np.nan
    assert usual_weights(replace(made_scan, sigma=some)) == "relative"


def test_fixed_parameters_hold_in_all_models_that_have_them(made_scan):
    found = choose(made_scan, ["minnaert", "ggx+minnaert", "lambert"], fix={"k": 0.9})
    for name in ("minnaert", "ggx+minnaert"):
        row = found.of(name)
        (k,) = [values for key, values in row.parameters.items() if key.split(".")[-1] == "k"]
        assert (k == 0.9).all()
    assert [found.of(m).free for m in ("minnaert", "ggx+minnaert", "lambert")] == [1, 4, 1]


def test_models_may_be_a_text_with_the_usual_ones(made_scan):
    names = default_candidates(made_scan)
    assert names == DEFAULT_CANDIDATES
    assert 10 <= len(names) <= 14
    found = choose(made_scan, "lambert, minnaert,lambert")
    assert {row.model for row in found.ranking} == {"lambert", "minnaert"}


@pytest.mark.parametrize(
    ("models", "given", "message"),
    [
        ("nonesuch", {}, "no model is called 'nonesuch'"),
        ("hapke+rpv", {}, "adds up whole surfaces .* or get_model"),
        ("", {}, "no models to compare"),
        (["lambert"], {"fix": {"n": 1.5}}, "none of the models has a parameter 'n' to fix: lambert"),
        (["rayleigh_rice"], {}, "no model is left to compare .rayleigh_rice: .* needs n"),
        (["ggx_anisotropic"], {}, "the sample was not turned"),
        (["lambert"], {"weights": "heavy"}, "no weights are called 'heavy'"),
        (["lambert"], {"wavelengths": 0}, "give a whole number of 1 or more"),
    ],
)
def test_mistakes_are_told_in_one_line(made_scan, models, given, message):
    with pytest.raises(InputError, match=message) as caught:
        choose(made_scan, models, **given)
    assert "\n" not in str(caught.value)


def test_a_wavelength_that_was_hardly_measured_shuts_out_no_model(made_scan, tmp_path):
    flags = np.zeros(made_scan.brdf.shape, int)
    flags[np.abs(made_scan.theta_r) != 15.0, 0] = 1  # 500 nm: 2 values left at each incident angle
    found = choose(replace(made_scan, flags=flags), ["lambert", "ggx+ggx+lambert"])
    assert found.skipped == ()
    assert found.thin == ("500 nm",)
    assert found.places.tolist() == [1]
    assert found.fit.vector.shape[0] == 2
    found.save(tmp_path / "fit.h5")
    assert Choice.open(tmp_path / "fit.h5").thin == ("500 nm",)
    # Among models that the few values are enough for, it counts.
    assert choose(replace(made_scan, flags=flags), ["lambert", "minnaert"]).places.tolist() == [0, 1]


def test_forced_sums_are_read_back(made_scan, tmp_path):
    found = choose(made_scan, ["hapke+ross_li"], force=True)
    found.save(tmp_path / "fit.h5")
    again = Choice.open(tmp_path / "fit.h5")
    assert again.chosen == again.fit.model.name == "hapke+ross_li"
    np.testing.assert_array_equal(again.values("hapke+ross_li"), found.values("hapke+ross_li"))
    assert pickle.loads(pickle.dumps(found.fit.model)).name == "hapke+ross_li"


def test_two_incident_angles_are_too_few(made_scan):
    two = made_scan.rows(made_scan.theta_i < 50.0)
    with pytest.raises(InputError, match=r"2 incident angles with usable values: .* needs 3 or more"):
        choose(two, ["lambert"])
    # A third one that is masked does not help.
    masked = replace(
        made_scan, flags=np.where(made_scan.theta_i < 50.0, 0, 1)[:, None] * np.ones((1, 2), int)
    )
    with pytest.raises(InputError, match="2 incident angles"):
        choose(masked, ["lambert"])


def test_models_with_too_many_parameters_are_skipped(made_scan):
    few = made_scan.rows(np.isin(np.abs(made_scan.theta_r), (15.0,)))
    found = choose(few, ["lambert", "ggx+ggx+lambert"])
    (skipped,) = found.skipped
    assert skipped.model == "ggx+ggx+lambert"
    assert skipped.reason == "6 values at 500 nm without θi = 15°, and 7 parameters need more than 7"
    with pytest.raises(InputError, match="no model is left to compare"):
        choose(few, ["ggx+ggx+lambert"])
