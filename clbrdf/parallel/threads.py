"""One thread for each process of many, so that n processes share n cores."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

ONE_THREAD = {
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "POCL_MAX_PTHREAD_COUNT": "1",  # PoCL up to 3
    "POCL_CPU_MAX_CU_COUNT": "1",  # PoCL from 4 on
}
"""Read by the libraries when they load. PoCL's are described in its manual, "Environment variables"."""


@contextmanager
def environment(values: Mapping[str, str]) -> Iterator[None]:
    """Give processes that start within the block these variables, such as `ONE_THREAD`."""
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
