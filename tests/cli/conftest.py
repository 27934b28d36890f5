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
