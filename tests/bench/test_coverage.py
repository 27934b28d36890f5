"""Error bars cover what they claim, on made scans with errors in common."""

import pytest

from clbrdf.bench.coverage import CASES, coverage, mean_check
from clbrdf.cli import main


@pytest.mark.soak
@pytest.mark.parametrize("name", CASES)
def test_one_sigma_of_every_parameter_covers_two_thirds(name):
    # 2000 scans: a share of 68.3 % scatters by 1.04 %; four of them to both sides.
    for row in coverage(name, 2000):
        assert row.scans == 2000
        assert 0.64 <= row.carried <= 0.725, row
        assert not 0.6 <= row.ignored <= 0.76, "without correlations it would do as well"
        # The standard deviation of 2000 scatters by 1.6 %.
        assert row.bar == pytest.approx(row.scatter, rel=0.065)


@pytest.mark.soak
def test_a_mean_over_wavelengths_scatters_as_claimed():
    mean = mean_check(scans=100)
    # The standard deviation of 100 scatters by 7 %; four of them.
    assert mean.claimed == pytest.approx(mean.actual, rel=0.28)
    assert mean.independent < 0.2 * mean.actual


def test_the_table(capsys, monkeypatch):
    monkeypatch.setattr("clbrdf.cli.bench_coverage.CASES", ("ggx+lambert",))
    monkeypatch.setattr(
        "clbrdf.cli.bench_coverage.mean_check",
        lambda device, report: mean_check("ggx+lambert", "lambert.rho", 4, 3, device=device, report=report),
    )
    assert main(["bench", "coverage", "--seeds", "50"]) == 0
    told = capsys.readouterr().out
    assert "Truth within 1σ, of 50 made scans" in told
    assert "Mean of lambert.rho over 4 wavelengths" in told
    assert main(["bench", "coverage", "--seeds", "5"]) == 2
