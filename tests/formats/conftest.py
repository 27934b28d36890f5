"""Fixtures of the tests of formats."""

from __future__ import annotations

import pytest

from clbrdf.errors import ON_COMMAND_LINE


@pytest.fixture(autouse=True)
def on_command_line():
    """Messages name options, as whoever imports files sees them."""
    before = ON_COMMAND_LINE.set(True)
    yield
    ON_COMMAND_LINE.reset(before)


@pytest.fixture
def text(tmp_path):
    def put(content, name="file.txt"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode("utf-8"))
        return path

    return put
