"""fit(rtol=): the word that is kept, the choice that is told, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import clbrdf
from clbrdf import InputError
from clbrdf.fit import AnnealSettings
from clbrdf.fit.methods import METHODS
from clbrdf.fit.problem import make_problem
from clbrdf.fit.tolerance import Rung, choose_settings, excess, measure_searches
from clbrdf.fit.words import search_lines
from clbrdf.models import get_model
from clbrdf.objective import weight_matrix


@pytest.fixture
def scan(small_scan):
    noise = np.random.default_rng(61).standard_normal(small_scan.brdf.shape)
    return replace(small_scan, brdf=small_scan.brdf * (1.0 + 0.06 * noise))


@pytest.mark.parametrize("method", ["auto", "anneal"])
@pytest.mark.parametrize("rtol", [1.0, 1e-2, 1e-9])
def test_the_word_is_kept(scan, method, rtol):
    best = clbrdf.fit(scan).objective
    fit = clbrdf.fit(scan, method=method, rtol=rtol)
    # 1e-12: rounding of the polish.
    assert (fit.objective <= best * (1.0 + rtol + 1e-12)).all()
    assert fit.setup.rtol == rtol
    assert "ms a wavelength" in search_lines(fit.search)[0]
    assert clbrdf.fit(scan, method=method).search.rungs == ()


def test_a_wide_tolerance_leaves_the_last_digits_out(scan):
    wide, exact = clbrdf.fit(scan, rtol=1.0), clbrdf.fit(scan, rtol=1e-9)
    assert "single precision" in wide.search.rungs[0].words
    assert "single precision" not in exact.search.rungs[0].words
    assert len(wide.search.rungs) == 2  # and what the next better one costs


def test_the_choice_does_not_hang_on_times(scan, device, monkeypatch):
    """The same rung whatever the clock says: the same seed has to give the same file."""
    import sys

    model = get_model()
    problem = make_problem(scan, weight_matrix(scan), model, model.bounds(), device)
    rungs = measure_searches(problem, METHODS["dictionary"], 0)
    rng = np.random.default_rng(62)
    chosen = set()
    for _ in range(5):
        shuffled = [Rung(r.words, r.settings, r.excess, float(rng.uniform(0, 9))) for r in rungs]
        monkeypatch.setattr(sys.modules["clbrdf.fit.tolerance"], "measure_searches", lambda *_, s=shuffled: s)
        chosen.add(choose_settings(problem, METHODS["dictionary"], 0, 1e-3)[0].words)
    assert len(chosen) == 1


def test_excess_of_exact_data_is_none():
    assert excess(
        np.array([1e-30, 2e-3]), [np.array([1e-31, 1e-3]), np.array([1e-28, 2e-3])]
    ) == pytest.approx(1.0)
    assert excess(np.array([1e-30]), [np.array([1e-31])]) == 0.0


def test_what_cannot_be_kept_is_refused(scan):
    with pytest.raises(InputError, match="rtol is 1e-12; give 1e-09 to 1"):
        clbrdf.fit(scan, rtol=1e-12)
    for rtol in (float("nan"), float("inf"), "x"):
        with pytest.raises(InputError, match=f"rtol is {rtol}; give"):
            clbrdf.fit(scan, rtol=rtol)
    with pytest.raises(InputError, match="settings and rtol both choose"):
        clbrdf.fit(scan, rtol=1e-3, settings=AnnealSettings())
    with pytest.raises(InputError, match="polish is 'half'; give one of none, single, double"):
        AnnealSettings(polish="half")
