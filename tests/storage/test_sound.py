"""The seal of a file, and what is done with files that have none."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import zlib

import h5py
import numpy as np
import pytest

from clbrdf import InputError, Scan
from clbrdf.storage import look, sound
from clbrdf.storage.seal import LENGTH, WORDS, is_sealed, seal


@pytest.fixture
def path(tmp_path):
    scan = Scan([10.0, 20.0], 0.0, [30.0, 40.0], 180.0, [450.0, 550.0], np.ones((2, 2)), sample="tile")
    scan.save(tmp_path / "scan.h5")
    return tmp_path / "scan.h5"


@pytest.fixture
def no_child(monkeypatch):
    """Opening a file may not start a process."""

    def fail(*_):
        raise AssertionError("a process was started")

    monkeypatch.setattr(sound, "_look", fail)


def test_the_seal_is_the_crc_of_all_before_it(path):
    content = path.read_bytes()
    told = int(content[-LENGTH:].removeprefix(WORDS), 16)
    assert told == zlib.crc32(content[:-LENGTH])
    with h5py.File(path) as file:  # HDF5 passes over it
        assert file["entry/sample/name"][()] == b"tile"


@pytest.mark.usefixtures("no_child")
def test_our_files_open_at_once(path):
    assert Scan.open(path).sample == "tile"


@pytest.mark.usefixtures("no_child")
@pytest.mark.parametrize("place", [60, 500, -LENGTH - 1, -3])
def test_any_changed_byte_breaks_the_seal(path, place):
    content = bytearray(path.read_bytes())
    content[place] ^= 1
    path.write_bytes(content)
    assert not is_sealed(path)
    with pytest.raises(AssertionError, match="a process was started"):
        Scan.open(path)


def test_a_file_that_another_program_changed_opens_after_a_look(path):
    with h5py.File(path, "a") as file:
        file["entry/sample/name"][()] = "wall"
        file["entry/note"] = "seen"
    assert not is_sealed(path)
    assert Scan.open(path).sample == "wall"
    seal(path)
    assert is_sealed(path)


def fail_with(path, *, memory=sound.MEMORY, seconds=5):
    """Exit status and output of the program that looks."""
    words = [sys.executable, "-P", look.__file__, str(path), str(memory), str(seconds)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=100)
    return done.returncode, done.stdout


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda f: f.__setitem__("a", h5py.ExternalLink("/etc/passwd", "/")), "a stands in another file"),
        (lambda f: f.create_dataset("b", (9,), "f8", external=[("x", 0, 72)]), "b stands in another file"),
        (lambda f: f.attrs.__setitem__("note", "x" * 100), ""),
        # Never written: takes no time.
        (lambda f: f.create_dataset("d", (2**31,), "f8", chunks=(2**16,)), ""),
    ],
)
def test_what_points_elsewhere_or_claims_too_much(tmp_path, change, said):
    with h5py.File(tmp_path / "x.h5", "w") as file:
        change(file)
    status, output = fail_with(tmp_path / "x.h5")
    assert (status, bool(output)) == (int(bool(said)), bool(said))
    assert said in output


def test_chunks_of_absurd_size(tmp_path, monkeypatch):
    with h5py.File(tmp_path / "x.h5", "w") as file:
        file.create_dataset("c", data=np.ones(5000), chunks=(2000,))
    look.look(str(tmp_path / "x.h5"))
    monkeypatch.setattr(look, "MOST_CHUNK", 10_000)
    with pytest.raises(ValueError, match="/c has chunks of 16000 bytes"):
        look.look(str(tmp_path / "x.h5"))


def test_limits_end_the_process(tmp_path):
    with h5py.File(tmp_path / "x.h5", "w") as file:
        file.create_dataset("a", data=np.ones(1 << 22), chunks=(1 << 22,))
    assert fail_with(tmp_path / "x.h5")[0] == 0
    assert fail_with(tmp_path / "x.h5", memory=1 << 24)[0] != 0
    code = f"from clbrdf.storage.look import limit\nlimit({4 << 30}, 1)\nwhile True: pass"
    done = subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, timeout=100)
    assert done.returncode == -signal.SIGXCPU
    assert sound.fault_of(done.returncode, "") == sound.ENDLESS
    assert sound.fault_of(-signal.SIGSEGV, "") == "HDF5 fails on it"
    assert sound.fault_of(1, "a line\n") == "a line"
    assert os.path.exists(look.__file__)


def test_a_damaged_file_is_told_once_in_one_line(path):
    content = bytearray(path.read_bytes())
    content[8:200] = bytes(192)
    path.write_bytes(content)
    before = sound._look.cache_info().misses
    for _ in range(2):
        with pytest.raises(InputError, match=r"scan\.h5: damaged HDF5 file \(.*\); copy it again"):
            Scan.open(path)
    assert sound._look.cache_info().misses == before + 1
