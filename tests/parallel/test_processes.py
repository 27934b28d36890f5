"""The pool, children, and how they end."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import textwrap
import time
from multiprocessing import active_children

import pytest

from clbrdf.errors import InputError
from clbrdf.opencl.device import choose_device
from clbrdf.parallel.children import run_child
from clbrdf.parallel.executor import Serial, run_jobs
from clbrdf.parallel.processes import Processes

POSIX = pytest.mark.skipif(not os.path.isdir("/proc/self/task"), reason="reads the children from /proc")


def fails(job):
    if job == 2:
        raise InputError("job 2 fails")
    return job


def threads_of(job):
    from clbrdf.opencl.device import choose_device

    return os.environ["OPENBLAS_NUM_THREADS"], choose_device().compute_units


def test_results_come_in_order_and_are_reported():
    told = []
    assert run_jobs(Serial(), abs, [-3, 2, -1], 3, lambda *step: told.append(step)) == [3, 2, 1]
    assert told == [(0, 3), (1, 3), (2, 3), (3, 3)]
    with Processes(2) as pool:
        assert run_jobs(pool, abs, range(-6, 0), 6) == [6, 5, 4, 3, 2, 1]


def test_a_job_that_fails_in_a_process_is_told_and_leaves_none_behind():
    before = set(active_children())
    with pytest.raises(InputError, match="job 2 fails"), Processes(2) as pool:
        run_jobs(pool, fails, range(8), 8)
    assert not set(active_children()) - before


def test_each_process_computes_in_one_thread():
    if choose_device().kind != "cpu":
        pytest.skip("the preferred device is no CPU: it has threads of its own")
    before = os.environ.get("POCL_MAX_PTHREAD_COUNT")
    with Processes(2) as pool:
        assert run_jobs(pool, threads_of, [0], 1) == [("1", 1)]
    assert os.environ.get("POCL_MAX_PTHREAD_COUNT") == before


def test_a_child_ends_in_time_and_does_not_look_in_the_current_folder(tmp_path, monkeypatch):
    (tmp_path / "clbrdf").mkdir()
    (tmp_path / "clbrdf" / "__init__.py").write_text("raise SystemExit('the wrong one')")
    monkeypatch.chdir(tmp_path)
    done = run_child(["-c", "import clbrdf; print(clbrdf.__version__)"], timeout=60.0)
    assert (done.returncode, done.stderr) == (0, "")
    with pytest.raises(subprocess.TimeoutExpired):
        run_child(["-c", "import time; time.sleep(60)"], timeout=0.5)


def children_of(pid):
    """Return the processes below one, whatever their depth."""
    found = []
    for task in os.listdir(f"/proc/{pid}/task"):
        with open(f"/proc/{pid}/task/{task}/children") as stream:
            for child in map(int, stream.read().split()):
                found += [child, *children_of(child)]
    return found


def is_running(pid):
    try:
        with open(f"/proc/{pid}/stat") as stream:
            return stream.read().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


WORK = """
import sys, time
from clbrdf.parallel.ending import end_on_signals, scratch_folder
from clbrdf.parallel.children import run_child
from clbrdf.parallel.processes import Processes
from clbrdf.storage.files import whole_file

def sleep(_):
    time.sleep(60)

if __name__ == "__main__":
    end_on_signals()
    with scratch_folder() as folder, whole_file(sys.argv[1]) as part, Processes(2) as pool:
        part.write_text("half")
        list(pool.map(abs, [1, 2]))
        print(folder, flush=True)
        if sys.argv[2] == "pool":
            list(pool.map(sleep, range(4)))
        else:
            code = "import time; from clbrdf.parallel.children import follow_parent; follow_parent()"
            run_child(["-c", code + "; time.sleep(60)"])
"""


@POSIX
@pytest.mark.parametrize("place", ["pool", "child"])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_nothing_stays_when_a_signal_ends_the_parent(tmp_path, number, place):
    (tmp_path / "work.py").write_text(WORK)
    words = [sys.executable, str(tmp_path / "work.py"), str(tmp_path / "out.txt"), place]
    process = subprocess.Popen(
        words,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "TMPDIR": str(tmp_path)},
    )
    folder = process.stdout.readline().strip()
    time.sleep(1.0)
    children = children_of(process.pid)
    assert len(children) >= 2
    process.send_signal(number)
    _, err = process.communicate(timeout=20)
    assert process.returncode == (-9 if number == signal.SIGKILL else 128 + number)
    deadline = time.monotonic() + 10.0
    while any(map(is_running, children)) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not [pid for pid in children if is_running(pid)]
    if number != signal.SIGKILL:  # which leaves nobody to clear up
        assert err.count("\n") == 1
        assert "nothing was left half-written" in err
        assert not os.path.exists(folder)
        assert [path.name for path in tmp_path.iterdir()] == ["work.py"]


def test_words_of_the_start_are_those_of_the_package(capfd, monkeypatch):
    import clbrdf_start
    from clbrdf.parallel.ending import ended_words

    monkeypatch.setattr(os, "_exit", lambda status: ended.append(status))
    ended = []
    for number in (signal.SIGINT, signal.SIGTERM):
        clbrdf_start._end_before_work(number, None)
        assert capfd.readouterr().err == ended_words(number) + "\n"
    assert ended == [130, 143]


def test_streams_that_are_closed_or_know_ascii_only(tmp_path):
    words = [sys.executable, "-m", "clbrdf.cli", "models", "wang2013"]
    done = subprocess.run(words, capture_output=True, env={**os.environ, "PYTHONIOENCODING": "ascii"})
    assert (done.returncode, done.stderr) == (0, b"")
    code = textwrap.dedent(
        """
        import os, subprocess, sys
        words = [sys.executable, "-m", "clbrdf.cli", "info", "missing.h5"]
        print(subprocess.run(words, preexec_fn=lambda: [os.close(k) for k in (0, 1, 2)]).returncode)
        """
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.stdout, done.stderr) == ("2\n", "")
