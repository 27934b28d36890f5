"""A disk that fills up: one line, nothing left behind, and no crash of HDF5.

A limit on the size of files stands for the full disk: the system refuses the same write with another number.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys

import h5py
import numpy as np
import pytest

from clbrdf import InputError, Scan
from clbrdf.storage.files import check_output
from clbrdf.storage.sink import Sink

WRITE = """
import resource, sys
import numpy as np
from clbrdf import InputError, Scan
rng = np.random.default_rng(1)
n, w = 4000, 40
theta_r, wavelength = np.linspace(0.0, 80.0, n), np.linspace(400.0, 700.0, w)
scan = Scan(np.full(n, 30.0), 0.0, theta_r, 180.0, wavelength, rng.random((n, w)))
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]), resource.RLIM_INFINITY))
try:
    scan.save(sys.argv[2], overwrite=True)
except InputError as error:
    print(error)
"""


@pytest.mark.parametrize("size", [4096, 5000, 30_000, 700_000, 1 << 30])
def test_a_scan_that_does_not_fit(tmp_path, size):
    target = tmp_path / "scan.h5"
    target.write_text("old")
    done = subprocess.run(
        [sys.executable, "-P", "-c", WRITE, str(size), str(target)],
        capture_output=True,
        text=True,
        timeout=200,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert list(tmp_path.iterdir()) == [target]
    if size < 1 << 30:
        assert done.stdout.startswith(f"{target}: cannot be written (File too large); files of this size")
        assert target.read_text() == "old"
    else:
        assert done.stdout == ""
        assert len(Scan.open(target)) == 4000


def test_hdf5_does_not_hear_of_it(tmp_path, monkeypatch):
    """Every write from some point on fails, those of what HDF5 holds back until it closes the file, too."""
    for good in (0, 1, 3, 8):
        sink = Sink(tmp_path / f"{good}.h5")
        left = [good]
        pwrite = os.pwrite

        def some(handle, data, place, left=left, pwrite=pwrite):
            left[0] -= 1
            if left[0] < 0:
                raise OSError(28, "No space left on device")
            return pwrite(handle, data, place)

        monkeypatch.setattr(os, "pwrite", some)
        with h5py.File(sink, "w") as file:
            for k in range(5):
                file.create_dataset(f"d{k}", data=np.arange(1000.0), chunks=(100,), compression="gzip")
        monkeypatch.undo()
        sink.close()
        with pytest.raises(OSError, match="No space left"):
            sink.check()


def test_what_cannot_be_written_is_told_before_the_work(tmp_path):
    with pytest.raises(InputError, match=r"cannot be written \(File name too long\); choose a shorter name"):
        check_output(tmp_path / ("x" * 250), overwrite=False)
    with pytest.raises(InputError, match="does not exist; create it first"):
        check_output(tmp_path / "no" / "x.h5", overwrite=False)
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    with pytest.raises(InputError, match="cannot be written"):
        check_output(tmp_path / "loop", overwrite=True)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, hard))
    try:
        with pytest.raises(InputError, match="File too large"):
            check_output(tmp_path / "x.h5", overwrite=False)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["loop"]


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_protected_folder(tmp_path):
    tmp_path.chmod(0o555)
    with pytest.raises(InputError, match="Permission denied"):
        check_output(tmp_path / "x.h5", overwrite=False)
