"""The simplest model within one paired standard error, against hand-made scores."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clbrdf.choose.rule import one_standard_error


def scores(*rows):
    """Scores of M models at I incident angles and one wavelength."""
    return np.array(rows, dtype=float)[:, :, None]


def test_the_standard_error_by_hand():
    # Differences 1, 2, 3: standard deviation 1, times √(1/3 + 1/2).
    compared = one_standard_error(scores([10.0, 10.0, 10.0], [11.0, 12.0, 13.0]), [3, 2])
    assert compared.best == 0
    assert compared.above.tolist() == [0.0, 2.0]
    assert compared.standard_error[1] == pytest.approx(np.sqrt(5.0 / 6.0), rel=1e-12)
    assert compared.within.tolist() == [True, False]
    assert compared.chosen == 0


def test_the_simpler_model_wins_within_one_error():
    noisy = scores([10.0, 10.0, 10.0], [9.0, 10.5, 11.0])
    assert one_standard_error(noisy, [5, 3]).chosen == 1
    assert one_standard_error(noisy, [3, 5]).chosen == 0


def test_among_equals_the_lower_score_wins():
    compared = one_standard_error(scores([10.0, 10.0, 10.0], [9.0, 10.5, 11.0], [9.0, 10.4, 11.0]), [5, 3, 3])
    assert compared.chosen == 2


def test_what_is_hard_for_all_models_cancels():
    # The third angle is 100 times as hard for both; one model is worse by 5 % everywhere.
    hard = np.array([1.0, 1.1, 100.0])
    compared = one_standard_error(scores(hard, 1.05 * hard), [4, 2])
    assert compared.standard_error[1] < hard.std(ddof=1) / np.sqrt(3)


def test_a_model_that_fails_at_one_angle_alone_is_not_within():
    fails = scores([1.0, 1.0, 1.0, 1.0], [1.0, 1.0, 1.0, 50.0])
    compared = one_standard_error(fails, [7, 1])
    assert compared.above[1] < compared.standard_error[1]
    assert not compared.within[1]


def test_wavelengths_are_no_independent_witnesses():
    rng = np.random.default_rng(1)
    one = rng.uniform(1.0, 2.0, (2, 5, 1))
    many = np.repeat(one, 40, axis=2)
    for name in ("mean", "above", "standard_error"):
        np.testing.assert_allclose(
            getattr(one_standard_error(many, [1, 2]), name),
            getattr(one_standard_error(one, [1, 2]), name),
            rtol=1e-12,  # rounding of a mean of 40
        )


def test_a_prediction_that_is_not_finite_is_never_chosen():
    compared = one_standard_error(scores([1.0, 1.0, 2.0], [0.5, np.inf, 0.5]), [4, 1])
    assert compared.chosen == 0
    assert not compared.within[1]


def test_angles_and_wavelengths_without_data_are_left_out():
    values = np.array([[[1.0, 2.0], [3.0, np.nan], [np.nan, np.nan], [2.0, 2.0]]] * 2)
    compared = one_standard_error(values, [2, 1])
    assert compared.mean.tolist() == pytest.approx([(1.5 + 3.0 + 2.0) / 3.0] * 2, rel=1e-15)
    assert compared.chosen == 1


@given(st.integers(0, 10**6), st.integers(2, 6), st.integers(3, 7), st.integers(1, 4))
def test_units_and_order_do_not_matter(seed, models, angles, wavelengths):
    rng = np.random.default_rng(seed)
    values = rng.lognormal(size=(models, angles, wavelengths))
    free = rng.integers(1, 9, models)
    chosen = one_standard_error(values, free).chosen
    order = rng.permutation(models)
    # A power of 2 scales exactly.
    assert order[one_standard_error(1024.0 * values[order], free[order]).chosen] == chosen
    turned = values[:, rng.permutation(angles)]
    np.testing.assert_allclose(one_standard_error(turned, free).mean, one_standard_error(values, free).mean)
