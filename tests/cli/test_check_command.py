"""`clbrdf fit --check`: verdicts in table, JSON and exit status."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

import clbrdf
from clbrdf import Fit
from clbrdf.cli import check
from clbrdf.optimizers.check import TOLERANCE
from tests.planted import with_parameters


@pytest.fixture
def fit(small_scan):
    noise = np.random.default_rng(3).standard_normal(small_scan.brdf.shape)
    return clbrdf.fit(replace(small_scan, brdf=small_scan.brdf * (1.0 + 0.06 * noise)))


@pytest.fixture
def words(fit, tmp_path, monkeypatch):
    """The scan in a file, and the words of a command that fits and checks it quickly, in this process."""
    fit.scan.save(tmp_path / "scan.h5")
    monkeypatch.setattr(check, "usable_cores", lambda: 1)
    budgets = {"least-squares": 900, "evolution": 6000}
    monkeypatch.setattr("clbrdf.optimizers.independent.EVALUATIONS", budgets)
    return ("fit", tmp_path / "scan.h5", "-o", tmp_path / "fit.h5")


def spoiled(fit, place):
    c = fit.parameters["c"].copy()
    c[place] *= 1.01
    return with_parameters(fit, {**fit.parameters, "c": c})


def test_verdicts_are_printed_and_written(run, words, tmp_path):
    written = ("--json", tmp_path / "fit.json")
    status, out, err = run(*words, *written, "--check-wavelengths", "2")
    assert (status, err) == (0, "")
    assert "Check: 2 of 3 wavelengths searched again" in out
    assert "2 agreed" in out
    assert max(len(line) for line in out.splitlines()) <= 100
    told = json.loads((tmp_path / "fit.json").read_text())["check"]
    assert told["tolerance"] == TOLERANCE
    assert [v["wavelength"] for v in told["verdicts"]] == [450.0, 650.0]
    status, out, _ = run(*words, "--check", "--overwrite")
    assert (status, "3 agreed" in out) == (0, True)


def test_a_worse_fit_is_kept_and_ends_in_status_1(run, words, fit, tmp_path, monkeypatch):
    monkeypatch.setattr("clbrdf.cli.fit_command.fit", lambda *_, **__: spoiled(fit, 1))
    status, out, err = run(*words, "--check")
    assert (status, err) == (1, "")
    assert "2 agreed, 1 worse: the fit is not at the global optimum at 550 nm" in out
    assert Fit.open(tmp_path / "fit.h5").parameters["c"][1] == spoiled(fit, 1).parameters["c"][1]


def test_smooth_fits_are_not_checked(run, words, tmp_path):
    status, _, err = run(*words, "--check", "--smooth", "0.01")
    assert (status, err.count("\n")) == (2, 1)
    assert "--check: a fit with smooth parameters gives up some of E on purpose" in err
    assert not (tmp_path / "fit.h5").exists()


@pytest.mark.parametrize("text", ["0", "-1", "some", "1.5", "²"])
def test_counts_are_checked_before_the_work(run, words, tmp_path, text):
    status, _, err = run(*words, f"--check-wavelengths={text}")
    assert status == 2
    assert f"--check-wavelengths {text!r}: give a whole number of 1 or more, or all" in err
    assert not (tmp_path / "fit.h5").exists()
