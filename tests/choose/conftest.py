"""A scan of GGX + Lambert with noise, and a choice among three models."""

from __future__ import annotations

import pytest

from clbrdf import Choice, Scan, choose
from tests.choose.made import MODELS, made


@pytest.fixture(scope="session")
def made_scan() -> Scan:
    return made()


@pytest.fixture(scope="session")
def choice(made_scan) -> Choice:
    return choose(made_scan, MODELS)
