"""A batch of 64 scans × 256 wavelengths that is disturbed: the same bytes, nothing lost, nothing twice.

CLBRDF_SOAK_SCANS and CLBRDF_SOAK_WAVELENGTHS name another size.
"""

from __future__ import annotations

import hashlib
import os
import random
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from clbrdf.bench.batch import write_scans
from tests.parallel.test_processes import children_of

pytestmark = [
    pytest.mark.soak,
    pytest.mark.skipif(not os.path.isdir("/proc/self/task"), reason="reads the processes from /proc"),
]

SCANS = int(os.environ.get("CLBRDF_SOAK_SCANS", "64"))
WAVELENGTHS = int(os.environ.get("CLBRDF_SOAK_WAVELENGTHS", "256"))
COMMAND = str(Path(sys.executable).with_name("clbrdf"))
LONGEST = 3600.0


@pytest.fixture(scope="module")
def scans(tmp_path_factory):
    folder = tmp_path_factory.mktemp("scans")
    return [Path(source.path) for source in write_scans(folder, SCANS, WAVELENGTHS)]


def start(scans, folder, *words):
    return subprocess.Popen(
        [COMMAND, "batch", *map(str, scans), "-o", str(folder), *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


def hashes_of(folder):
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in folder.glob("*.h5")}


@pytest.fixture(scope="module")
def calm(scans, tmp_path_factory):
    """Hashes of a batch that nobody disturbs, and of single fits of its first scans."""
    folder = tmp_path_factory.mktemp("calm")
    process = start(scans, folder / "catalogue", "--workers", "2")
    told = process.communicate(timeout=LONGEST)[0]
    assert process.returncode == 0, told
    hashes = hashes_of(folder / "catalogue")
    for scan in scans[:3]:
        words = [COMMAND, "fit", str(scan), "-o", str(folder / scan.name)]
        subprocess.run(words, check=True, capture_output=True, timeout=LONGEST)
        assert hashlib.sha256((folder / scan.name).read_bytes()).hexdigest() == hashes[scan.name]
    return hashes


def check(folder, calm):
    assert hashes_of(folder) == calm
    table = pq.read_table(folder / "index.parquet", columns=["scan", "column", "fit_sha256", "fit_file"])
    rows = table.to_pylist()
    assert len({(row["scan"], row["column"]) for row in rows}) == len(rows) == SCANS * WAVELENGTHS
    assert all(calm[row["fit_file"]] == row["fit_sha256"] for row in rows)
    assert not list(folder.rglob("*.part"))


def done_in(folder):
    return len(list((folder / "rows").glob("[!.]*.parquet"))) if folder.exists() else 0


def wait_for(process, folder, count):
    while process.poll() is None and done_in(folder) < count:
        time.sleep(0.05)


def workers_of(pid):
    """Return the processes that compute: those with OpenCL's library in their memory."""
    found = []
    for child in children_of(pid):
        try:
            if "libpocl" in Path(f"/proc/{child}/maps").read_text():
                found.append(child)
        except OSError:
            continue
    return found


def test_workers_killed_in_the_middle(scans, calm, tmp_path):
    folder, chance = tmp_path / "catalogue", random.Random(1)
    process, killed = start(scans, folder, "--workers", "2"), 0
    for share in (0.1, 0.4, 0.7):
        wait_for(process, folder, max(1, int(share * SCANS)))
        time.sleep(chance.random() * 0.3)
        for worker in workers_of(process.pid)[:1]:
            os.kill(worker, signal.SIGKILL)
            killed += 1
    told = process.communicate(timeout=LONGEST)[0]
    assert process.returncode == 0, told
    assert killed > 0
    check(folder, calm)


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT, signal.SIGTERM])
def test_the_whole_batch_ended_and_resumed(scans, calm, tmp_path, number):
    folder, ends = tmp_path / "catalogue", []
    for share in (0.2, 0.5, 0.8):
        process = start(scans, folder, "--workers", "2", *(["--resume"] if folder.exists() else []))
        wait_for(process, folder, max(1, int(share * SCANS)))
        process.send_signal(number)
        told = process.communicate(timeout=60.0)[0]
        ends.append(process.returncode)
        assert "Traceback" not in told
        if number != signal.SIGKILL:
            assert not list(folder.rglob("*.part"))
    assert ends == 3 * [-9 if number == signal.SIGKILL else 128 + number]
    process = start(scans, folder, "--workers", "2", "--resume")
    told = process.communicate(timeout=LONGEST)[0]
    assert process.returncode == 0, told
    assert "scans done before" in told
    check(folder, calm)


def test_the_scheduler_killed_and_started_again(scans, calm, tmp_path):
    folder = tmp_path / "catalogue"
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{probe.getsockname()[1]}"

    def cluster():
        dask = [sys.executable, "-m", "distributed.cli"]
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        name = "dask_scheduler", "dask_worker"
        port = address.rpartition(":")[2]
        scheduler = [dask[0], "-m", f"distributed.cli.{name[0]}", "--port", port, "--host", "127.0.0.1"]
        worker = [dask[0], "-m", f"distributed.cli.{name[1]}", address, "--nthreads", "1"]
        worker += ["--local-directory", str(tmp_path), "--death-timeout", "30"]
        return subprocess.Popen([*scheduler, "--no-dashboard"], **quiet), [
            subprocess.Popen(worker, **quiet) for _ in range(2)
        ]

    scheduler, workers = cluster()
    try:
        process = start(scans, folder, "--scheduler", address)
        wait_for(process, folder, SCANS // 3)
        scheduler.kill()
        told = process.communicate(timeout=120.0)[0]
        assert process.returncode == 2, told
        assert "has gone; scans that are finished are kept: start it again and add --resume" in told
        assert "Traceback" not in told
        for each in (scheduler, *workers):
            each.kill()
            each.wait()
        scheduler, workers = cluster()
        process = start(scans, folder, "--scheduler", address, "--resume")
        told = process.communicate(timeout=LONGEST)[0]
        assert process.returncode == 0, told
    finally:
        for each in (scheduler, *workers):
            each.kill()
            each.wait()
    check(folder, calm)
