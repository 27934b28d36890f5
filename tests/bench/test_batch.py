"""`clbrdf bench batch`, small."""

from __future__ import annotations

import pytest

from clbrdf.cli import bench_batch, main

pytest.importorskip("distributed", reason="Dask is not installed (extra [cluster])")
pytest.importorskip("pyarrow", reason="Arrow is not installed (extra [cluster])")


def test_the_table_tells_time_and_whether_the_bytes_are_the_same(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "100")
    monkeypatch.setattr(bench_batch, "usable_cores", lambda: 1)
    content = bench_batch.bench_batch(scans=2, wavelengths=3, tasks=40)
    out = capsys.readouterr().out
    assert [run["workers"] for run in content["runs"]] == [0, 1]
    assert all(run["same"] for run in content["runs"])
    assert content["sizes"]["tasks"] == 3
    assert 0.0 < content["task_busy_seconds"] < 1.0
    assert "one process, no Dask" in out
    assert "NO" not in out.split()
    assert max(len(line) for line in out.splitlines()) <= 100


def test_mistakes(capsys):
    for words, said in (
        (("batch", "--scans", "0"), "0 scans of 256 wavelengths"),
        (("fit", "--scans", "2"), "--scans: bench fit does not take it"),
        (("batch", "--seeds", "2"), "--seeds: bench batch does not take it"),
    ):
        assert main(["bench", *words]) == 2
        assert said in capsys.readouterr().err
