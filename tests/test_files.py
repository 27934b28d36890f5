"""Results appear whole or not at all."""

from __future__ import annotations

import json

import pytest

from clbrdf import InputError
from clbrdf.storage.files import check_output, whole_file, whole_text


def test_a_failure_leaves_nothing(tmp_path):
    with pytest.raises(RuntimeError), whole_file(tmp_path / "out.txt") as part:
        part.write_text("half")
        raise RuntimeError
    assert list(tmp_path.iterdir()) == []


def test_a_failure_keeps_what_was_there(tmp_path):
    target = tmp_path / "out.txt"
    target.write_text("old")
    with pytest.raises(KeyboardInterrupt), whole_file(target, overwrite=True) as part:
        part.write_text("half")
        raise KeyboardInterrupt
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_a_file_that_comes_meanwhile_is_kept(tmp_path):
    target = tmp_path / "out.txt"
    with pytest.raises(InputError, match="exists already"), whole_file(target) as part:
        part.write_text("mine")
        target.write_text("theirs")
    assert target.read_text() == "theirs"
    assert list(tmp_path.iterdir()) == [target]


def test_a_folder_is_no_output(tmp_path):
    with pytest.raises(InputError, match="is a folder"):
        check_output(tmp_path, overwrite=True)


def test_json_has_null_where_numbers_are_not_finite(tmp_path):
    whole_text(tmp_path / "out.json", {"a": [1.0, float("nan"), float("inf")], "b": {"c": None}})
    assert json.loads((tmp_path / "out.json").read_text()) == {"a": [1.0, None, None], "b": {"c": None}}
