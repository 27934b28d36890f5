"""Damaged files of every kind end in one clear line or are read: no traceback, hang, crash or much memory.

Files are read in processes of their own, some hundred each, so that a crash or a hang inside a library is
counted and the next file is read all the same.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from tests.damaged import sources, worker

ROOT = Path(__file__).resolve().parents[2]
CHUNK = 500
PATIENCE = 1800.0
"""Wall time of a chunk, s, on a machine that does other things, too."""

MOST_MEMORY = 2_000_000_000 >> 10
"""KiB."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("damaged")
    (path / "sound").mkdir()
    sources.make(path / "sound")
    return path


def test_what_is_damaged_was_sound(folder):
    for name, read in sources.readers(folder).items():
        read(folder / "sound" / name)


def chunk(folder: Path, start: int, stop: int, seed: int) -> list[dict]:
    """Read some files; go on behind one that ends the process."""
    out = []
    while start < stop:
        words = [sys.executable, "-P", "-m", "tests.damaged.worker", folder, start, stop, seed]
        known = os.pathsep.join([str(ROOT), *os.environ.get("PYTHONPATH", "").split(os.pathsep)])
        env = {"PYTHONPATH": known.rstrip(os.pathsep), "PATH": "/usr/bin:/bin", "HOME": str(folder)}
        try:
            done = subprocess.run(
                list(map(str, words)), env=env, cwd=folder, capture_output=True, text=True, timeout=PATIENCE
            )
            ended = f"exit status {done.returncode}: {done.stderr[-1500:]}"
        except subprocess.TimeoutExpired:
            ended = "hang where no signal reaches"
        found = folder / f"done-{start}"
        if found.exists():
            return [*out, json.loads(found.read_text())]
        number = int((folder / f"now-{start}").read_text())
        out.append(
            {
                "counts": {"crash": 1},
                "failures": [{"number": number, "error": ended}],
                "peak": 0,
                "slowest": 0,
            }
        )
        start = number + 1
    return out


def run(folder: Path, count: int, seed: int, processes: int) -> Counter:
    """Read that many files; print what came out, kind by kind; return the verdicts."""
    with ThreadPoolExecutor(processes) as pool:
        starts = range(0, count, CHUNK)
        parts = pool.map(lambda start: chunk(folder, start, min(start + CHUNK, count), seed), starts)
        results = [one for part in parts for one in part]
    counts = sum((Counter(one["counts"]) for one in results), Counter())
    failures = [failure for one in results for failure in one["failures"]]
    peak, slowest = max(one["peak"] for one in results), max(one["slowest"] for one in results)
    for name, number in sorted(counts.items()):
        print(f"{name:40s} {number}")
    for failure in failures[:40]:
        print(failure)
    total = Counter()
    for name, number in counts.items():
        total[name.rpartition(" ")[2]] += number
    print(f"{sum(counts.values())} files, {dict(total)}, peak {peak / 1024:.0f} MiB, slowest {slowest:.1f} s")
    assert not failures, f"seed {seed}: {len(failures)} failures, first {failures[0]}"
    assert peak < MOST_MEMORY
    return total


def test_hundreds_of_damaged_files(folder):
    total = run(folder, 3 * len(worker.kinds(list(sources.readers(folder)))), 1, 1)
    assert total["refused"] > total["read"] > 10


@pytest.mark.soak
def test_100000_damaged_files(folder):
    run(folder, 100_000, 2, 2)


COMMANDS = {
    "scan.h5": (
        ["info", "FILE"],
        ["fit", "FILE", "-o", "OUT.h5", "--method", "dictionary"],
        ["export", "FILE", "-o", "OUT.csv"],
    ),
    "several.h5": (["info", "FILE"], ["info", "FILE::two"]),
    "fit.h5": (["info", "FILE"], ["export", "FILE", "-o", "OUT.csv"], ["view", "FILE", "--html", "OUT.html"]),
    "choice.h5": (["info", "FILE"], ["report", "FILE", "-o", "OUT.html"]),
    "raw.h5": (["calibrate", "FILE", "-o", "OUT.h5"], ["budget", "--scan", "FILE"]),
    "long.csv": (["import", "FILE", "-o", "OUT.h5"],),
    "wide.csv": (["import", "FILE", "-o", "OUT.h5"],),
    "weights.csv": (["fit", "SOUND/scan.h5", "-o", "OUT.h5", "--weights", "FILE"],),
    "spectrum.csv": (["fit", "SOUND/scan.h5", "-o", "OUT.h5", "--model", "ggx", "--fix", "ggx.n=FILE"],),
    "scene.toml": (["simulate", "FILE", "-o", "OUT.h5"],),
    "plan.toml": (["measure", "FILE", "--rig", "SOUND/rig.toml", "--dry-run"],),
    "rig.toml": (["measure", "SOUND/plan.toml", "--rig", "FILE", "--dry-run"],),
    "budget.toml": (["budget", "FILE"],),
}
"""Commands that read a file of each kind."""


def command_line(folder: Path, count: int, seed: int) -> Counter:
    """Give damaged files to commands; each ends with 0, 1 or 2, and with 2 in one line."""
    names, counts, failures = sorted(COMMANDS), Counter(), []
    for number in range(count):
        name, _, path = worker.make(folder, number, seed, names)
        choices = COMMANDS[name]
        words = [
            w.replace("FILE", str(path)).replace("SOUND", str(folder / "sound"))
            for w in choices[number % len(choices)]
        ]
        outputs = [word for word in words if word.startswith("OUT")]
        words = [str(folder / word) if word in outputs else word for word in words]
        try:
            done = subprocess.run(
                [sys.executable, "-P", "-m", "clbrdf.cli", *words],
                capture_output=True, text=True, cwd=folder, timeout=300,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            counts["hang"] += 1
            failures.append((number, words, "hang"))
            continue
        told = [line for line in done.stderr.splitlines() if line.startswith("clbrdf:")]
        bad = "Traceback" in done.stderr or done.returncode not in (0, 1, 2)
        bad |= done.returncode == 2 and (len(told) != 1 or len(told[0]) > 1000)
        bad |= done.returncode == 2 and any((folder / name).exists() for name in outputs)
        counts["bad" if bad else {0: "done", 1: "verdict"}.get(done.returncode, "refused")] += 1
        if bad:
            failures.append((number, words, done.returncode, done.stderr[-1200:]))
        for output in outputs:
            (folder / output).unlink(missing_ok=True)
        path.unlink()
    for failure in failures:
        print(failure)
    print(f"{count} commands, {dict(counts)}")
    assert not failures, f"seed {seed}: {failures[0]}"
    return counts


@pytest.mark.soak
def test_500_damaged_files_by_command(folder):
    command_line(folder, 500, 3)
