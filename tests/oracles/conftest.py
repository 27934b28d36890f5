"""Who is compared with other people's programs: the references, and the package's own models."""

from __future__ import annotations

import pytest

from clbrdf.models import model_names
from tests.oracles.subjects import SUBJECTS, Subject


@pytest.fixture(params=SUBJECTS)
def subject(request: pytest.FixtureRequest) -> Subject:
    """Each subject in turn."""
    return SUBJECTS[request.param]


@pytest.fixture
def has_model(subject: Subject):
    """Skip what the package does not hold."""

    def check(name: str) -> None:
        if subject is SUBJECTS["package"] and name not in model_names():
            pytest.skip(f"clbrdf has no model {name}")

    return check
