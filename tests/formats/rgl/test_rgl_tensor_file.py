"""The container: bytes laid down by hand, round trips, and files that lie about their size."""

from __future__ import annotations

import struct
import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from clbrdf import InputError
from clbrdf.formats.rgl.tensor_file import TYPES, read_tensor_file, write_tensor_file


def by_hand(fields, version=(1, 0)):
    """Bytes of a tensor file, written down from the description: one pass for the head, one for the data."""
    head = b"tensor_file\0" + struct.pack("<BBI", *version, len(fields))
    size = len(head) + sum(2 + len(name) + 2 + 1 + 8 + 8 * len(shape) for name, _, shape, _ in fields)
    data = b""
    for name, code, shape, payload in fields:
        data += bytes((-(size + len(data))) % 8)
        head += struct.pack("<H", len(name)) + name.encode()
        head += struct.pack("<HBQ", len(shape), code, size + len(data)) + struct.pack(
            f"<{len(shape)}Q", *shape
        )
        data += payload
    return head + data


def test_bytes_by_hand_are_read_and_written(tmp_path):
    numbers = struct.pack("<6f", *range(6))
    content = by_hand([("a", 10, (2, 3), numbers), ("note", 1, (2,), b"hi"), ("n", 5, (1,), b"\7\0\0\0")])
    (tmp_path / "in.bsdf").write_bytes(content)
    fields = read_tensor_file(tmp_path / "in.bsdf")
    np.testing.assert_array_equal(fields["a"], np.arange(6.0).reshape(2, 3))
    assert fields["note"].tobytes() == b"hi"
    assert fields["n"].tolist() == [7]
    write_tensor_file(tmp_path / "out.bsdf", fields)
    assert (tmp_path / "out.bsdf").read_bytes() == content


@given(
    st.dictionaries(
        st.text(min_size=1, max_size=12),
        st.sampled_from(list(TYPES.values())).flatmap(
            lambda kind: hnp.arrays(kind, hnp.array_shapes(min_dims=0, max_dims=5, max_side=4))
        ),
        max_size=5,
    )
)
def test_round_trip(tmp_path_factory, fields):
    path = tmp_path_factory.mktemp("tensor") / "f.bsdf"
    write_tensor_file(path, fields)
    back = read_tensor_file(path)
    assert list(back) == list(fields)
    for name, array in fields.items():
        assert back[name].dtype == array.dtype
        assert back[name].shape == array.shape
        assert back[name].tobytes() == array.tobytes()


GOOD = by_hand([("a", 10, (2, 3), bytes(24))])


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"tensor", "is no tensor file"),
        (b"#\n" * 20, "is no tensor file"),
        (by_hand([], version=(2, 0)), "version 2.0, and 1.0 is read"),
        (GOOD[:-1], "field 'a' claims bytes up to"),
        (GOOD[:20], "ends within the name|cut short or garbled"),
        (by_hand([("a", 12, (1,), bytes(8))]), "field 'a' has type 12, and 1 to 11 are known"),
        (by_hand([("a", 10, (2**40, 2**40), b"")]), "field 'a' claims bytes up to"),
        (by_hand([("a", 10, (2**63, 0), b"")]), "field 'a' claims the shape"),
        (by_hand([("a", 10, (1,) * 17, bytes(4))]), "field 'a' claims 17 dimensions"),
        (by_hand([("a", 1, (1,), b"x"), ("a", 1, (1,), b"x")]), "field 'a' is there twice"),
        (b"tensor_file\0" + struct.pack("<BBI", 1, 0, 2**32 - 1), "cut short or garbled"),
    ],
)
def test_what_is_wrong_is_said_before_anything_is_allocated(tmp_path, content, message):
    path = tmp_path / "bad.bsdf"
    path.write_bytes(content)
    tracemalloc.start()
    with pytest.raises(InputError, match=message) as told:
        read_tensor_file(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert str(told.value).startswith(str(path))
    assert "\n" not in str(told.value)
    # The claims are 2**32 bytes and more. Python's own work beside them, other threads' too, is below 1 MB.
    assert peak < 10_000_000


def test_no_such_file(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_tensor_file(tmp_path / "none.bsdf")


@given(data=st.data())
def test_mutated_files_are_read_or_refused(tmp_path_factory, data):
    content = bytearray(GOOD)
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.mktemp("mutated") / "f.bsdf"
    path.write_bytes(content[: data.draw(st.integers(0, len(content)))])
    try:
        fields = read_tensor_file(path)
    except InputError:
        return
    assert sum(array.nbytes for array in fields.values()) <= 16 * len(content)


def test_types_that_the_container_lacks(tmp_path):
    with pytest.raises(ValueError, match="complex128"):
        write_tensor_file(tmp_path / "c.bsdf", {"c": np.zeros(2, complex)})
    assert not list(tmp_path.iterdir())
