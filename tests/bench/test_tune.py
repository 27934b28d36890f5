"""Tuning survives compilers that crash or hang, and its answer is found again."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest

import clbrdf
from clbrdf import DeviceError
from clbrdf.bench import tune as tuning
from clbrdf.fit import AnnealSettings
from clbrdf.opencl.answers import read_answer
from clbrdf.opencl.lanes import Lanes, keep_answers, lanes_of, safe_lanes


@pytest.fixture
def empty_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("CLBRDF_CACHE_DIR", str(tmp_path / "cache"))
    read_answer.cache_clear()
    yield tmp_path / "cache"
    read_answer.cache_clear()


def python_that(tmp_path, behaviour):
    """An interpreter that runs the real child for narrow widths and misbehaves at 16 lanes."""
    script = tmp_path / "python"
    script.write_text(
        f'#!/bin/sh\ncase "$4" in *\'"width": 16\'*) {behaviour};; *) exec "{sys.executable}" "$@";; esac\n'
    )
    script.chmod(0o755)
    return str(script)


@pytest.mark.parametrize(
    ("behaviour", "said"), [("kill -SEGV $$", "crashed (SIGSEGV)"), ("exec sleep 60", "no answer in 8 s")]
)
def test_a_width_that_crashes_or_hangs_costs_a_message(
    device, tmp_path, empty_cache, monkeypatch, behaviour, said
):
    monkeypatch.setattr(tuning, "WIDTHS", {"float32": (8, 16), "float64": (4,)})
    monkeypatch.setattr(sys, "executable", python_that(tmp_path, behaviour))
    cpu = replace(device, kind="cpu")
    trials, path = tuning.tune(cpu, seconds=8.0)
    bad = [t for t in trials if t.lanes.width == 16]
    assert {t.failure for t in bad} == {said}
    assert path.parent == empty_cache
    assert lanes_of(cpu, np.float32).width == 8
    assert all(t.rate > 0.0 for t in trials if not t.failure)
    # The program goes on with the answer.
    assert np.isfinite(clbrdf.evaluate({}, 30.0, 30.0, 180.0, device=cpu)).all()


def test_sixteen_lanes_are_tried_in_a_child_and_survived(device):
    """On AVX-512 machines the wheel's PoCL aborts or hangs here; elsewhere it may work."""
    trials = tuning.try_width(replace(device, kind="cpu"), "float32", 16, seconds=15.0)
    assert len(trials) == len(tuning.UNROLLS)
    assert all((t.rate > 0.0) != bool(t.failure) for t in trials)
    assert np.isfinite(clbrdf.evaluate({}, 30.0, 30.0, 180.0, device=device)).all()


def test_nothing_that_works_is_an_error(device, tmp_path, empty_cache, monkeypatch):
    monkeypatch.setattr(tuning, "WIDTHS", {"float32": (16,), "float64": (16,)})
    monkeypatch.setattr(sys, "executable", python_that(tmp_path, "exit 3"))
    with pytest.raises(DeviceError, match="no vector width of float32 works"):
        tuning.tune(replace(device, kind="cpu"), seconds=8.0)


def test_answers_belong_to_device_driver_and_sources(device, empty_cache):
    assert lanes_of(device, np.float32) == safe_lanes(device, np.float32)
    keep_answers(device, {"float32": Lanes(4, 2)})
    assert lanes_of(device, np.float32) == Lanes(4, 2)
    assert lanes_of(device, np.float64) == safe_lanes(device, np.float64)
    other = replace(device, driver="another")
    assert lanes_of(other, np.float32) == safe_lanes(other, np.float32)
    next(empty_cache.iterdir()).write_text("{damaged")
    read_answer.cache_clear()
    assert lanes_of(device, np.float32) == safe_lanes(device, np.float32)


def test_a_gpu_has_one_lane(device):
    assert safe_lanes(replace(device, kind="gpu"), np.float64) == Lanes(1, 1)


def test_width_and_unrolling_change_nothing_but_rounding(device, small_scan, empty_cache):
    settings = AnnealSettings(chains=16, levels=8)
    wide = clbrdf.fit(small_scan, settings=settings, device=device)
    keep_answers(device, {"float32": Lanes(4, 1), "float64": Lanes(2, 1)})
    narrow = clbrdf.fit(small_scan, settings=settings, device=device)
    np.testing.assert_allclose(narrow.vector, wide.vector, rtol=1e-6)
