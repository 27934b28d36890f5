"""Running commands in this process."""

from __future__ import annotations

import pytest

from clbrdf.cli import main


@pytest.fixture
def run(capsys, monkeypatch):
    """Run a command line; give (exit status, standard output, standard error)."""
    monkeypatch.setenv("COLUMNS", "100")

    def run(*words):
        status = main([str(word) for word in words])
        captured = capsys.readouterr()
        return status, captured.out, captured.err

    return run


@pytest.fixture
def scan_file(small_scan, tmp_path):
    small_scan.save(tmp_path / "scan.h5")
    return tmp_path / "scan.h5"


def assert_one_line(result, *words):
    """An error is one line on standard error with exit status 2, and nothing else."""
    status, out, err = result
    assert status == 2
    assert out == ""
    assert err.startswith("clbrdf: ")
    assert err.count("\n") == 1
    for word in words:
        assert word in err
