"""The race of fits: scans as said, children that report, peers that are judged, tables that fit."""

from __future__ import annotations

import json

import numpy as np
import pytest

from clbrdf.bench import fit_race
from clbrdf.bench.fit_race import RacePlan, RaceRun, found_share, growth, peer_places, race_scan
from clbrdf.cli import bench_fit as command
from clbrdf.cli import main
from clbrdf.fit.requests import check_range
from clbrdf.objective import weight_matrix
from tests.models.test_every_model import MODELS


@pytest.mark.parametrize("incident", [3, 6])
def test_scans_have_the_directions_that_are_claimed(incident):
    scan = race_scan(incident, 5)
    assert scan.brdf.shape == (fit_race.DIRECTIONS, 5)
    assert len(scan.incident_angles) == incident
    assert len(race_scan(incident, 2, views=0.5).theta_i) == pytest.approx(fit_race.DIRECTIONS / 2, rel=0.03)


def run(w, seconds, method="auto"):
    return RaceRun(method, 3, fit_race.DIRECTIONS, w, seconds, 1e8, np.ones(w))


def test_growth_is_told_per_doubling():
    runs = [run(16, 1.0), run(64, 9.0), run(64, 9.0), run(64, 1000.0), run(16, 1.0, "anneal")]
    assert growth(runs, 3, 64) == pytest.approx(3.0)  # 9 times in two doublings


def test_found_is_within_a_millionth_of_the_lowest():
    assert found_share(np.array([1.0, 1.0 + 0.9e-6, 1.0 + 1.1e-6, 2.0]), np.ones(4)) == 0.5


def test_peers_fit_wavelengths_spread_over_the_scan():
    assert peer_places(2048)[[0, -1]].tolist() == [0, 2047]
    assert len(peer_places(2048)) == fit_race.PEER_WAVELENGTHS
    assert peer_places(3).tolist() == [0, 1, 2]


def test_the_command_prints_and_writes(monkeypatch, tmp_path, capsys):
    small = RacePlan(sizes=(2, 4), slow_sizes=(2,), incident=(3,), peers=(("least-squares", (40, 80)),))
    monkeypatch.setattr(command, "RacePlan", lambda: small)
    monkeypatch.setattr(fit_race, "SLOW", ("tempering",))
    monkeypatch.setenv("COLUMNS", "100")
    assert main(["bench", "fit", "--json", str(tmp_path / "f.json")]) == 0
    out = capsys.readouterr().out
    assert max(map(len, out.splitlines())) <= 100
    assert "Twice the wavelengths take" in out
    content = json.loads((tmp_path / "f.json").read_text())
    assert {row["method"] for row in content["runs"]} == {"auto", "tempering"}
    assert all(row["peak"] > 1e7 and row["seconds"] > 0.0 for row in content["runs"])
    assert next(row["evaluations"] for row in content["peers"]) == 40


def test_a_child_that_fails_is_one_line(device, monkeypatch):
    from clbrdf import DeviceError

    monkeypatch.setattr(fit_race.sys, "executable", "/bin/false")
    with pytest.raises(DeviceError, match="the fit of 2 wavelengths by auto failed"):
        fit_race.fit_in_child("auto", 3, 2, device)


@pytest.mark.parametrize("name", MODELS)
def test_the_scan_of_any_model_can_be_fitted(name):
    """Narrow lobes end below what a fit takes for a value in 1/sr."""
    scan = race_scan(6, 2, model=name)
    check_range(scan, weight_matrix(scan, "none"))
    assert not scan.mask.any()
