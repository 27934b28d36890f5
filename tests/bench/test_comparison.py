"""Figures of merit against hand-made runs and brute force; the command's tables, words, file and figure."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from clbrdf import InputError
from clbrdf.bench import profiles
from clbrdf.bench.comparison import (
    LONGEST,
    TARGETS,
    OptimizerRun,
    Rules,
    Task,
    distinct_methods,
    run_methods,
    run_optimizers,
)
from clbrdf.bench.optimizers_figure import optimizers_figure
from clbrdf.bench.problems import problem_set
from clbrdf.bench.profiles import (
    costs_of,
    data_profile,
    ecdf,
    ecdf_band,
    expected_running_time,
    success_rates,
)
from clbrdf.bench.references import reference_of
from clbrdf.bench.verdict import verdict
from clbrdf.fit import METHODS
from clbrdf.optimizers import OPTIMIZERS
from clbrdf.parallel.processes import Processes

INF = float("inf")


def hand_made(contender, wavelength, seed, reached, cost, spent):
    """A run that reaches the first `reached` targets at a cost of 1, 2, 3 … times `cost`."""
    to = tuple(cost * (k + 1.0) if k < reached else INF for k in range(len(TARGETS)))
    seconds = tuple(0.001 * c for c in to)
    gap = 0.5 * TARGETS[reached - 1] if reached else 1.0
    return OptimizerRun(contender, "p", wavelength, seed, to, seconds, gap, spent, 0.001 * spent)


@pytest.fixture
def costs():
    """Two wavelengths, two seeds: all targets; six; none; two."""
    runs = [
        hand_made("crs2", 450.0, 0, 8, 10.0, 80.0),
        hand_made("crs2", 450.0, 1, 6, 10.0, 100.0),
        hand_made("crs2", 550.0, 0, 0, 10.0, 100.0),
        hand_made("crs2", 550.0, 1, 2, 20.0, 100.0),
    ]
    return costs_of(runs, "crs2")


def test_success_rates_and_running_times_by_hand(costs):
    assert success_rates(costs).tolist() == [0.75, 0.75, 0.5, 0.5, 0.5, 0.5, 0.25, 0.25]
    ert = expected_running_time(costs, "evaluations")
    # 10 + 10 + 100 (a miss costs all it spent) + 20, over 3 successes; for the last 80 + 300, over 1.
    assert ert[0] == pytest.approx(140.0 / 3.0)
    assert ert[7] == pytest.approx(380.0)
    np.testing.assert_allclose(expected_running_time(costs, "seconds"), 0.001 * ert)


def test_nothing_reached_is_an_infinite_running_time():
    costs = costs_of([hand_made("esch", 450.0, s, 0, 1.0, 50.0) for s in range(3)], "esch")
    assert (expected_running_time(costs, "evaluations") == INF).all()
    assert (success_rates(costs) == 0.0).all()


def test_ecdf_counts_every_target_of_every_run(costs):
    grid = np.array([5.0, 10.0, 20.0, 79.0, 80.0, 1e9])
    counted = [np.mean([c <= b for c in costs.evaluations.ravel()]) for b in grid]
    assert ecdf(costs.evaluations, grid).tolist() == counted
    assert counted[-1] == 16 / 32


def test_bands_hold_the_curve_and_the_spread_of_a_share():
    rng = np.random.default_rng(5)
    share, i, s = 0.3, 1, 400
    reached = rng.random((i, s, 1)) < share
    to_target = np.where(reached, 1.0, INF)
    low, high = ecdf_band(to_target, np.array([0.5, 2.0]))
    assert (low[0], high[0]) == (0.0, 0.0)
    measured = reached.mean()
    assert low[1] < measured < high[1]
    # 90 % of a binomial share; the bootstrap of 200 draws knows its percentiles to some 15 %.
    half = 1.645 * np.sqrt(measured * (1.0 - measured) / s)
    assert (high[1] - low[1]) / 2.0 == pytest.approx(half, rel=0.3)


def test_data_profiles_take_the_median_seed(costs):
    # Gap 0.1: medians (of 2, the lower) 10 and 20 evaluations; gap 1e-6: 60 and none.
    grid = np.array([9.0, 10.0, 19.0, 20.0, 1e9]) / 7.0
    assert data_profile(costs, TARGETS[0], grid, 6).tolist() == [0.0, 0.5, 0.5, 1.0, 1.0]
    assert data_profile(costs, TARGETS[5], np.array([59.0, 60.0, 1e9]) / 7.0, 6).tolist() == [0.0, 0.5, 0.5]


def test_words_follow_the_numbers():
    sure = [hand_made("least-squares", w, s, 8, 5.0, 40.0) for w in (450.0, 550.0) for s in range(4)]
    poor = [hand_made("crs2", w, s, s == 0, 5.0, 400.0) for w in (450.0, 550.0) for s in range(4)]
    ours = [hand_made("anneal", w, s, 8 if s else 3, 9.0, 90.0) for w in (450.0, 550.0) for s in range(4)]
    table = [costs_of(sure + poor + ours, name) for name in ("least-squares", "crs2", "anneal")]
    words = verdict(table, 400)
    assert words.startswith("Over 2 wavelengths, up to 8 runs a contender and 400 evaluations a run, a gap")
    assert "of 1e-06 was reached in 99.5 % of runs or more by scipy least_squares multi-start (100 %" in words
    assert "Without derivatives none reached it in half of its runs; the best is nlopt CRS2-LM" in words
    assert "Less than half of their runs came within 0.001: nlopt CRS2-LM." in words
    assert "use clbrdf anneal" in words
    assert "75 % within 1e-06) and look at it with --check" in words
    assert verdict(table[1:2], 400).count("nobody reached a gap of 1e-06") == 1


@pytest.fixture(scope="module")
def tasks():
    from dataclasses import replace

    out = []
    for problem in problem_set(("foil-1", "weak")):
        some = replace(problem, scan=problem.scan.columns([1]))
        out.append(Task(some, reference_of(problem)[[1]]))
    return out


SMALL = Rules(
    optimizers=("least-squares", "direct", "random"), methods=("anneal",), seeds=2, evaluations=1500
)


def test_runs_are_those_asked_for_whatever_the_processes(tasks):
    runs = run_optimizers(tasks, SMALL)
    with Processes(2) as executor:
        again = run_optimizers(tasks, SMALL, executor)
    assert [(r.contender, r.problem, r.seed) for r in runs] == [
        (name, task.problem.name, seed)
        for name in SMALL.optimizers
        for task in tasks
        for seed in range(2 if OPTIMIZERS[name].random else 1)
    ]
    assert [(r.evaluations, r.gap, r.spent) for r in runs] == [(r.evaluations, r.gap, r.spent) for r in again]
    for run in runs:
        assert run.wavelength == 550.0
        assert [np.isfinite(c) for c in run.evaluations] == [run.gap <= t for t in TARGETS]
        assert max((c for c in run.evaluations if c < INF), default=0.0) <= run.spent <= 1501
        assert run.elapsed < 2 * LONGEST


@pytest.mark.parametrize("objective", ["opencl", "separable"])
def test_other_objectives_reach_the_same_optimum(tasks, objective):
    rules = Rules(optimizers=("evolution", "least-squares"), seeds=1, evaluations=20_000, objective=objective)
    runs = run_optimizers(tasks[:1], rules)
    # Derivatives are not there with ks and kd solved inside.
    assert {r.contender for r in runs} == {"evolution"} | (
        {"least-squares"} if objective == "opencl" else set()
    )
    assert min(r.gap for r in runs) < 1e-8


def test_our_methods_are_run_as_users_call_them(tasks, device):
    runs = run_methods(tasks, SMALL, device)
    assert [(r.problem, r.seed) for r in runs] == [("foil-1", 0), ("foil-1", 1), ("weak", 0), ("weak", 1)]
    for run in runs:
        assert all(c in (run.spent, INF) for c in run.evaluations)
        assert run.gap < 1e-2
        assert run.elapsed > 0.0


def test_auto_is_left_out_where_it_is_another(tasks, device):
    distinct = distinct_methods(tasks, device)
    assert set(METHODS) - {"auto"} <= set(distinct)
    assert distinct_methods(tasks, device, ("auto",)) == ("auto",)


def test_rules_are_checked():
    for changes, said in (
        ({"optimizers": ("guess",)}, "no optimizer is called 'guess'"),
        ({"methods": ("guess",)}, "no method is called 'guess'"),
        ({"objective": "guess"}, "no objective is called 'guess'; there are numpy, opencl, separable"),
        ({"seeds": 0}, "seeds is 0"),
        ({"evaluations": 0}, "evaluations is 0"),
    ):
        with pytest.raises(InputError, match=said):
            Rules(**changes)


def test_the_figure_has_every_contender(costs, monkeypatch):
    monkeypatch.setattr(profiles, "RESAMPLES", 20)
    other = costs_of([hand_made("random", 450.0, s, 0, 1.0, 50.0) for s in range(2)], "random")
    figure = optimizers_figure([costs, other], 6, "a test")
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert texts == ["nlopt CRS2-LM", "random search"]
    assert all(len(axes.get_lines()) == 2 for axes in figure.axes)
    drawn = figure.axes[3].get_lines()[0].get_ydata()
    np.testing.assert_allclose(drawn, 100.0 * success_rates(costs))
    optimizers_figure([other], 6, "nothing reached")


class TestCommand:
    WORDS = ("bench", "optimizers", "--problems", "foil-1", "--evaluations", "600", "--seeds", "2")

    @pytest.fixture
    def run(self, capsys, monkeypatch):
        from clbrdf.cli import bench_optimizers, main

        monkeypatch.setenv("COLUMNS", "100")
        monkeypatch.setattr(bench_optimizers, "usable_cores", lambda: 1)
        monkeypatch.setattr(profiles, "RESAMPLES", 20)

        def run(*words):
            status = main([str(word) for word in words])
            return status, *capsys.readouterr()

        return run

    def test_tables_words_file_and_figure(self, run, tmp_path):
        files = ("--json", tmp_path / "o.json", "--png", tmp_path / "o.png")
        few = ("--optimizers", "least-squares,random,anneal")
        status, out, err = run(*self.WORDS, *few, *files)
        assert (status, err) == (0, "")
        assert max(len(line) for line in out.splitlines()[2:]) <= 100
        for text in (
            "scipy least_squares multi-start",
            "random search",
            "clbrdf anneal",
            "∞ 0/2",
            "tin foil",
        ):
            assert text in out
        assert (tmp_path / "o.png").read_bytes().startswith(b"\x89PNG")
        told = json.loads((tmp_path / "o.json").read_text())
        assert [c["name"] for c in told["contenders"]] == ["least-squares", "random", "anneal"]
        assert np.shape(told["contenders"][0]["evaluations"]) == (1, 2, 8)
        assert told["problems"][0]["reference"] == [reference_of(problem_set(("foil-1",))[0])[1]]
        assert " ".join(told["words"].split()) in " ".join(out.split())

    def test_a_scan_of_the_users(self, run, small_scan, tmp_path):
        from dataclasses import replace

        noise = np.random.default_rng(0).standard_normal(small_scan.brdf.shape)
        replace(small_scan, brdf=small_scan.brdf * (1 + 0.03 * noise)).save(tmp_path / "mine.h5")
        words = ("bench", "optimizers", "--problems", "none", "--scan", tmp_path / "mine.h5")
        small = ("--optimizers", "least-squares", "--seeds", "1", "--evaluations", "2000")
        status, out, err = run(*words, *small)
        assert (status, err) == (0, "")
        assert "mine (scan)" in out
        assert "in 99.5 % of runs or more by scipy least_squares" in " ".join(out.split())

    @pytest.mark.parametrize(
        ("words", "said"),
        [
            (("--problems", "soap"), "--problems: nothing is called 'soap'; there are foil-exact"),
            (("--optimizers", "guess"), "--optimizers: nothing is called 'guess'; there are crs2"),
            (("--seeds", "0"), "seeds is 0; give 1 to"),
            (("--wavelengths", "-1"), "--wavelengths -1"),
            (("--objective", "gpu"), "no objective is called 'gpu'"),
            (("--problems", "none"), "--problems none leaves nothing to run; add --scan FILE"),
            (("--scan", "no.h5"), "no.h5: no such file"),
        ],
    )
    def test_mistakes(self, run, words, said):
        status, _, err = run("bench", "optimizers", *words)
        assert status == 2
        assert err.startswith("clbrdf: ")
        assert err.count("\n") == 1
        assert said in err

    def test_options_of_optimizers_belong_to_it(self, run):
        status, _, err = run("bench", "throughput", "--seeds", "3")
        assert (status, err.count("\n")) == (2, 1)
        assert "--seeds: bench throughput does not take it; it belongs to bench optimizers" in err

    def test_references_again(self, run, tmp_path, monkeypatch):
        budgets = {"least-squares": 500, "evolution": 4000}
        monkeypatch.setattr("clbrdf.optimizers.independent.EVALUATIONS", budgets)
        monkeypatch.setattr("clbrdf.cli.bench_optimizers.problem_set", lambda: problem_set(("foil-1",)))
        status, out, err = run("bench", "references", "--json", tmp_path / "r.json")
        assert (status, err) == (0, "")
        assert out.count("foil-1") == 3
        made = json.loads((tmp_path / "r.json").read_text())
        np.testing.assert_allclose(
            made["problems"]["foil-1"]["objective"], reference_of(problem_set(("foil-1",))[0]), rtol=1e-9
        )


@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="needs POSIX signals")
def test_interrupted_it_ends_in_one_line_and_leaves_no_process(tmp_path):
    """Ctrl-C in a terminal reaches the whole group: only the parent speaks."""
    command = [sys.executable, "-m", "clbrdf.cli", "bench", "optimizers", "--json", str(tmp_path / "o.json")]
    running = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    children = []
    deadline = time.monotonic() + 60.0
    while len(children) < 2 and time.monotonic() < deadline:
        time.sleep(0.1)
        children = children_of(running.pid)
    assert children
    time.sleep(1.0)
    os.killpg(running.pid, signal.SIGINT)
    out, err = running.communicate(timeout=60.0)
    assert (running.returncode, out) == (130, "")
    assert err == "clbrdf: interrupted; nothing was left half-written\n"
    assert not (tmp_path / "o.json").exists()
    deadline = time.monotonic() + 30.0
    while any(is_running(pid) for pid in children) and time.monotonic() < deadline:
        time.sleep(0.1)  # the tracker of Python's multiprocessing ends a moment after its parent
    assert not [pid for pid in children if is_running(pid)]


def children_of(pid):
    try:
        with open(f"/proc/{pid}/task/{pid}/children", encoding="ascii") as stream:
            return [int(word) for word in stream.read().split()]
    except OSError:
        return []


def is_running(pid):
    try:
        with open(f"/proc/{pid}/stat", encoding="ascii") as stream:
            return stream.read().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False
