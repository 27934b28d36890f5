"""Damaged files of every format end in one clear line or in a sound scan: no traceback, no hang, no flood."""

from __future__ import annotations

import time
from collections import Counter
from pathlib import Path

import h5py
import numpy as np
import pytest

import clbrdf
from clbrdf import InputError, Scan
from clbrdf.bench.memory import peak_memory
from clbrdf.formats.load import load
from tests.formats import made_files as made
from tests.formats.mutate import mutated

SAMPLES = Path(__file__).resolve().parents[3] / "shared" / "data" / "formats"
LONGEST = 20.0
"""Seconds for one small file, on a busy machine."""


def sources(folder: Path) -> dict[str, bytes]:
    out = {name: path.read_bytes() for name, path in made.write_all(folder).items()}
    out["merl"] = made.merl()[:5000]
    out["utia"] = made.utia()[:3000]
    scan = Scan([10.0, 20.0], 0.0, [30.0, 40.0], 180.0, [450.0, 550.0], np.ones((2, 2)))
    scan.save(folder / "scan.h5")
    return out


def check(path: Path) -> str:
    """Read a file; a scan that comes out has to be one."""
    start = time.perf_counter()
    try:
        loaded = load([path])
    except InputError as error:
        text = str(error)
        assert "\n" not in text, text
        assert path.name in text, text
        verdict = "refused"
    else:
        for scan in loaded.scans.values():
            n, w = scan.brdf.shape
            assert n == len(scan.theta_i) == len(scan.phi_r)
            assert w == len(scan.wavelength)
            assert np.isfinite(scan.brdf[~scan.mask]).all()
        verdict = "read"
    assert time.perf_counter() - start < LONGEST
    return verdict


def run(folder: Path, contents: dict[str, bytes], count: int, seed: int) -> dict[str, Counter]:
    out = {name: Counter() for name in contents}
    names, failures = list(contents), {}
    for k in range(count):
        name = names[k % len(names)]
        rng = np.random.default_rng([seed, k])
        path = folder / f"damaged{['.txt', '.csv', '.bin'][k % 3]}"
        path.write_bytes(mutated(contents[name], rng))
        try:
            out[name][check(path)] += 1
        except Exception as error:
            failures[f"{name}: {type(error).__name__}: {error}"[:200]] = k
    assert not failures, f"seed {seed}: {failures}"
    return out


def test_400_damaged_files(tmp_path):
    found = run(tmp_path, sources(tmp_path), 400, 1)
    total = sum(found.values(), Counter())
    assert total["refused"] > 100  # damage is seen
    assert total["read"] > 10  # and does not always matter


@pytest.mark.soak
def test_20000_damaged_files_in_2_gigabytes(tmp_path):
    contents = sources(tmp_path)
    if SAMPLES.is_dir():
        for path in sorted(SAMPLES.glob("*/*")):
            if path.suffix and path.stat().st_size < 200_000:
                contents[path.name] = path.read_bytes()
    before = peak_memory()
    found = run(tmp_path, contents, 20_000, 2)
    peak = peak_memory()
    for name, counts in found.items():
        print(f"{name:45s} {dict(counts)}")
    print(f"peak {peak >> 20} MiB, {(peak - before) >> 20} MiB of it by reading")
    assert peak < 2 << 30


def opened_or_refused(path: Path) -> None:
    try:
        scan = Scan.open(path)
    except InputError as error:
        text = str(error)
    else:
        assert scan.brdf.shape == (len(scan.theta_i), len(scan.wavelength))
        return
    assert "\n" not in text
    assert path.name in text


@pytest.mark.parametrize("seed", range(60))
def test_a_damaged_scan_file(tmp_path, seed):
    """Values in the file's structure are changed with HDF5 itself; libhdf5 guards its own bytes."""
    scan = Scan(
        [10.0, 20.0], 0.0, [30.0, 40.0], 180.0, [450.0, 550.0], np.ones((2, 2)), sigma=np.ones((2, 2))
    )
    path = tmp_path / "scan.h5"
    scan.save(path)
    rng = np.random.default_rng(seed)
    with h5py.File(path, "a") as file:
        names = []
        file.visit(names.append)
        name = names[rng.integers(len(names))]
        kind = rng.integers(5)
        attributes = dict(file[name].attrs)
        if kind == 0:
            del file[name]
        elif kind == 1:
            del file[name]
            file.create_dataset(name, shape=(10**6, 10**6), dtype="f8", chunks=(64, 64))
        elif kind == 2:
            del file[name]
            file[name] = ["text", "other"]
        elif kind == 3:
            del file[name]
            file.create_group(name)
        elif attributes:
            key = list(attributes)[rng.integers(len(attributes))]
            file[name].attrs[key] = np.arange(3)
    opened_or_refused(path)


@pytest.fixture(scope="module")
def fit_file(tmp_path_factory):
    rng = np.random.default_rng(1)
    theta_r = np.tile(np.linspace(0.0, 75.0, 8), 2)
    values = 0.2 + rng.uniform(0.0, 0.01, (16, 2))
    scan = Scan(np.repeat([30.0, 60.0], 8), 0.0, theta_r, 180.0, [450.0, 550.0], values)
    path = tmp_path_factory.mktemp("fit") / "fit.h5"
    clbrdf.fit(scan).save(path)
    return path.read_bytes()


@pytest.mark.parametrize("seed", range(40))
def test_a_damaged_fit_file(tmp_path, fit_file, seed):
    path = tmp_path / "fit.h5"
    path.write_bytes(fit_file)
    rng = np.random.default_rng([5, seed])
    with h5py.File(path, "a") as file:
        names = []
        file["entry/fit"].visit(lambda name: names.append(f"entry/fit/{name}"))
        name = names[rng.integers(len(names))]
        del file[name]
        kind = rng.integers(4)
        if kind == 0:
            file.create_dataset(name, shape=(10**6, 10**6), dtype="f8", chunks=(64, 64))
        elif kind == 1:
            file[name] = ["text", "other"]
        elif kind == 2:
            file.create_group(name)
    try:
        clbrdf.Fit.open(path)
    except InputError as error:
        text = str(error)
    else:
        return
    assert "\n" not in text
    assert "fit.h5" in text


@pytest.mark.parametrize("seed", range(40))
def test_flipped_bytes_of_a_scan_file(tmp_path, seed):
    scan = Scan([10.0, 20.0], 0.0, [30.0, 40.0], 180.0, [450.0, 550.0], np.ones((2, 2)))
    path = tmp_path / "scan.h5"
    scan.save(path)
    rng = np.random.default_rng([3, seed])
    content = bytearray(path.read_bytes())
    for place in rng.integers(8, len(content), 3):
        content[place] ^= int(rng.integers(1, 256))
    path.write_bytes(bytes(content))
    opened_or_refused(path)
