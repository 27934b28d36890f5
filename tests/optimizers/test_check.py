"""The check finds a planted bad fit and says which, agrees with good ones, and leaves rounding alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import clbrdf
from clbrdf import Fit, InputError
from clbrdf.bench.problems import problem_set
from clbrdf.bench.references import problem_of, reference_of
from clbrdf.optimizers.check import TOLERANCE, check_fit, sample_places
from clbrdf.optimizers.gap import relative_gap
from clbrdf.optimizers.independent import search_twice
from clbrdf.optimizers.objective import NumpyObjective
from clbrdf.parallel.processes import Processes
from tests.coating import MADE
from tests.planted import with_parameters, with_part

QUICK = 0.15
"""Effort: the small scans here are easy."""


@pytest.fixture
def fit(small_scan):
    noise = np.random.default_rng(3).standard_normal(small_scan.brdf.shape)
    return clbrdf.fit(replace(small_scan, brdf=small_scan.brdf * (1.0 + 0.06 * noise)))


def corrupted(fit, place, name="c", factor=1.01):
    parameters = {key: values.copy() for key, values in fit.parameters.items()}
    parameters[name][place] *= factor
    return with_parameters(fit, parameters)


def test_a_good_fit_agrees(fit):
    verdicts = check_fit(fit, effort=QUICK)
    assert [v.word for v in verdicts] == ["agreed"] * 3
    assert [v.wavelength for v in verdicts] == fit.wavelength.tolist()
    assert [v.objective for v in verdicts] == pytest.approx(fit.objective.tolist(), rel=1e-10)


def test_both_searches_find_the_optimum_by_themselves(fit):
    found = check_fit(fit, [1], effort=0.5)[0].found
    assert list(found.values()) == pytest.approx([fit.objective[1]] * 2, rel=TOLERANCE)


@pytest.mark.parametrize("place", [0, 1, 2])
def test_a_planted_bad_fit_is_found_in_its_file_and_named(fit, place, tmp_path):
    corrupted(fit, place).save(tmp_path / "fit.h5")
    verdicts = check_fit(Fit.open(tmp_path / "fit.h5"), effort=QUICK)
    assert [k for k, v in enumerate(verdicts) if v.word == "worse"] == [place]
    bad = corrupted(fit, place).evaluate()[:, place] - fit.scan.brdf[:, place]
    E = (bad**2).sum() / (fit.scan.brdf[:, place] ** 2).sum()
    assert verdicts[place].objective == pytest.approx(E, rel=1e-9)
    assert verdicts[place].gap == pytest.approx(E / fit.objective[place] - 1.0, rel=1e-4)


def test_a_fit_within_a_tolerance_is_held_to_it(fit):
    # c 1 % off costs some 1e-4 of E here.
    bad = corrupted(fit, 1)
    gap = check_fit(bad, [1], effort=QUICK)[0].gap
    for rtol, word in ((2.0 * gap, "agreed"), (0.5 * gap, "worse")):
        told = with_part(bad, "setup", rtol=rtol)
        assert check_fit(told, [1], effort=QUICK)[0].word == word


def test_parameters_that_are_not_numbers_are_worse(fit):
    assert check_fit(corrupted(fit, 1, factor=np.nan), [1], effort=QUICK)[0].word == "worse"


def test_data_without_noise_agree_down_to_rounding(small_scan):
    fit = clbrdf.fit(small_scan)
    assert {v.word for v in check_fit(fit, effort=QUICK)} == {"agreed"}
    # A deviation of 1e-8 in ks is 1e-16 in E: 1e-4 of the floor, and no rounding any more.
    assert check_fit(corrupted(fit, 0, "ks", 1.0 + 1e-8), [0], effort=QUICK)[0].word == "worse"


def test_weights_bounds_and_masks_are_those_of_the_fit(small_scan):
    flags = np.zeros(small_scan.brdf.shape, np.uint32)
    flags[:, 1] = 1
    scan = replace(small_scan, flags=flags)
    fit = clbrdf.fit(scan, weights="sigma", bounds={"d": (0.8, 1.0)})
    assert sample_places(fit).tolist() == [0, 2]
    assert {v.word for v in check_fit(fit, effort=QUICK)} == {"agreed"}
    with pytest.raises(InputError, match="nothing to check at 550 nm"):
        check_fit(fit, [1])
    with pytest.raises(InputError, match="no wavelength 3 to check; the fit has 3"):
        check_fit(fit, [3])


def test_fits_with_tied_wavelengths_are_refused(small_scan):
    with pytest.raises(InputError, match="gives up some of E on purpose"):
        check_fit(clbrdf.fit(small_scan, smooth=0.1))


def test_samples_are_spread_over_the_range(fit):
    assert sample_places(fit, 2).tolist() == [0, 2]
    assert sample_places(fit, None).tolist() == sample_places(fit, 99).tolist() == [0, 1, 2]
    with pytest.raises(InputError, match="0 wavelengths to check"):
        sample_places(fit, 0)


def test_processes_do_not_change_the_verdicts(fit):
    with Processes(2) as executor:
        assert check_fit(fit, effort=0.02, executor=executor) == check_fit(fit, effort=0.02)


def test_gaps_have_a_floor():
    np.testing.assert_allclose(relative_gap([2.0, 1e-18, 0.0], [1.0, 0.0, 0.0]), [1.0, 1e-6, 0.0])
    assert relative_gap(np.nan, 1.0) == np.inf


@pytest.mark.soak
@pytest.mark.parametrize("problem", problem_set(), ids=lambda problem: problem.name)
def test_each_search_reaches_the_reference_by_itself(problem):
    reference, whole = reference_of(problem), problem_of(problem.scan)
    jobs = [(NumpyObjective(whole, w), seed) for w in range(len(reference)) for seed in (1, 2)]
    for k, (objective, seed) in enumerate(jobs):
        for found in search_twice(objective, seed):
            assert relative_gap(found.objective, reference[k // 2]) <= TOLERANCE, (found, seed)


FILES = {
    "black_coatings_in_plane.csv": (
        *("nite_on_invar", "opticalblackanodize_on_al", "titaniumanodize_on_ti", "z307_on_al"),
    ),
    "black_coatings_hemisphere_650nm.csv": (
        *("AnoBlackEC1onAlum", "AnoBlackEC2onAlum", "AnoBlackNiTEonINVAR", "AnoBlackNiTEonSteel"),
    ),
}


@pytest.mark.soak
@pytest.mark.parametrize(
    ("file", "sample"), [("", MADE), *((file, s) for file, names in FILES.items() for s in names)]
)
def test_coatings_agree_everywhere(coating, file, sample):
    fit = clbrdf.fit(coating(file, sample))
    for verdict in check_fit(fit, sample_places(fit, None)):
        assert verdict.gap <= TOLERANCE, verdict


@pytest.mark.parametrize("sample", [MADE, "nite_on_invar"])
def test_a_coating_agrees(coating, sample):
    fit = clbrdf.fit(coating("black_coatings_in_plane.csv", sample))
    assert check_fit(fit, [1], effort=0.3)[0].gap <= TOLERANCE
