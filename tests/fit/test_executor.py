"""The fit over an executor: whatever runs the blocks, the same bytes."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import clbrdf
from clbrdf.fit import blocks
from clbrdf.parallel.executor import Serial
from clbrdf.parallel.processes import Processes
from clbrdf.scans import sample_scan


@pytest.fixture(scope="module")
def scan():
    whole = clbrdf.Scan.open(sample_scan("yellow_tin_foil"))
    return whole.columns(np.arange(0, len(whole.wavelength), 8))


@pytest.mark.parametrize("model", ["wang2013", "ggx+lambert"])
def test_every_executor_leaves_the_same_bytes(scan, model, tmp_path, monkeypatch):
    clbrdf.fit(scan, model=model).save(tmp_path / "whole.h5")
    monkeypatch.setattr(blocks, "BLOCK_BYTES", 7 * 32 * len(scan))  # a few wavelengths a block
    told = []
    with Processes(2) as processes, ThreadPoolExecutor(1) as threads:
        for name, executor in (("serial", Serial()), ("processes", processes), ("threads", threads)):
            fit = clbrdf.fit(scan, model=model, executor=executor, report=lambda *step: told.append(step))
            fit.save(tmp_path / f"{name}.h5")
            assert (tmp_path / f"{name}.h5").read_bytes() == (tmp_path / "whole.h5").read_bytes()
            assert told[-1][0] == told[-1][1] > 1
