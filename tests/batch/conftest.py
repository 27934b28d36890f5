"""One cluster for all tests of the batch: two processes, as `clbrdf batch` starts them."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest

import clbrdf
from clbrdf.scans import sample_scan

pytest.importorskip("distributed", reason="Dask is not installed (extra [cluster])")
pytest.importorskip("pyarrow", reason="Arrow is not installed (extra [cluster])")


@pytest.fixture(scope="session")
def client():
    from clbrdf.batch.cluster import load_dask, local_cluster

    load_dask()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with local_cluster(2) as client:
            yield client


@pytest.fixture
def address(client):
    return client.scheduler.address


@pytest.fixture(scope="session")
def scans(tmp_path_factory):
    """Four scans of 6 wavelengths, tin foil with noise of its own each."""
    folder = tmp_path_factory.mktemp("scans")
    whole = clbrdf.Scan.open(sample_scan("yellow_tin_foil"))
    part = whole.columns(np.linspace(0, len(whole.wavelength) - 1, 6).round().astype(np.intp))
    paths = []
    for k in range(4):
        noise = 1.0 + 0.02 * np.random.default_rng(k).standard_normal(part.brdf.shape)
        paths.append(folder / f"foil{k}.h5")
        replace(part, brdf=part.brdf * noise, sample=f"foil {k}").save(paths[-1])
    return paths
