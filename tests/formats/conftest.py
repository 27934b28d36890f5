"""Fixtures of the tests of formats."""

from __future__ import annotations

import pytest


@pytest.fixture
def text(tmp_path):
    def put(content, name="file.txt"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode("utf-8"))
        return path

    return put
