"""Every optimizer keeps limits, budget, seeds and its best point; the good ones find the optimum."""

from __future__ import annotations

import threading
import warnings

import numpy as np
import pytest

from clbrdf import InputError
from clbrdf.bench.problems import problem_set
from clbrdf.bench.references import problem_of, reference_of
from clbrdf.optimizers import OPTIMIZERS, minimise
from clbrdf.optimizers.gap import relative_gap, target_value
from clbrdf.optimizers.objective import NumpyObjective
from clbrdf.optimizers.separable import SeparableObjective
from clbrdf.optimizers.trace import Finished, Recorder

BUDGET = 400


class Spy:
    """An objective that notes every point it is asked for."""

    def __init__(self, inner):
        self.inner, self.lower, self.upper, self.points = inner, inner.lower, inner.upper, []

    def values(self, q):
        self.points += [np.array(x) for x in q]
        return self.inner.values(q)

    def value_and_gradient(self, q):
        self.points.append(np.array(q))
        return self.inner.value_and_gradient(q)

    def residuals(self, q):
        self.points.append(np.array(q))
        return self.inner.residuals(q)


@pytest.fixture(scope="module")
def foil():
    (problem,) = problem_set(("foil-6",))
    return NumpyObjective(problem_of(problem.scan)), reference_of(problem)[0]


@pytest.fixture(scope="module", params=OPTIMIZERS)
def runs(request, foil):
    """Two runs of one optimizer from one seed, one from another, and what the first one asked for."""
    spy = Spy(foil[0])
    first = minimise(request.param, spy, evaluations=BUDGET, seed=3)
    again = minimise(request.param, foil[0], evaluations=BUDGET, seed=3)
    other = minimise(request.param, foil[0], evaluations=BUDGET, seed=4)
    return OPTIMIZERS[request.param], spy, first, again, other


def test_limits_and_budget_are_kept(runs):
    _, spy, first, *_ = runs
    points = np.array(spy.points)
    assert (points >= spy.lower).all()
    assert (points <= spy.upper).all()
    # A gradient costs two: the last may begin with one evaluation left.
    assert 0 < first.spent <= BUDGET + 1
    assert len(points) <= first.spent


def test_the_best_point_is_kept(runs, foil):
    _, spy, first, *_ = runs
    E = foil[0].values(np.array(spy.points))
    # The value of a point evaluated with its residuals is rounded elsewhere.
    assert first.best == pytest.approx(E.min(), rel=1e-12)
    assert foil[0].values(first.coordinates[None])[0] == pytest.approx(first.best, rel=1e-12)


def test_the_trace_falls(runs):
    _, _, first, *_ = runs
    assert (np.diff(first.objective) < 0.0).all()
    assert (np.diff(first.evaluations) > 0).all()
    assert (np.diff(first.seconds) >= 0.0).all()
    assert first.evaluations[-1] <= first.spent
    assert first.seconds[-1] <= first.elapsed


def test_the_same_seed_gives_the_same_run_and_another_seed_another(runs):
    optimizer, _, first, again, other = runs
    assert first.objective.tobytes() == again.objective.tobytes()
    assert first.evaluations.tobytes() == again.evaluations.tobytes()
    assert (first.objective.tobytes() == other.objective.tobytes()) == (not optimizer.random)


def test_optimizers_that_end_early_start_again_until_the_budget_is_spent(runs):
    optimizer, _, first, *_ = runs
    if optimizer.random:
        assert first.spent >= BUDGET


@pytest.mark.parametrize(
    ("name", "evaluations"), [("least-squares", 4000), ("mlsl-lbfgs", 8000), ("crs2", 20_000)]
)
def test_a_run_stops_at_its_target(foil, name, evaluations):
    objective, reference = foil
    aim = target_value(reference, 0.5)
    trace = minimise(name, objective, evaluations=evaluations, seed=1, target=aim)
    assert trace.best <= aim
    assert trace.spent < evaluations
    # At once: the last evaluation is the one that reached it, with its derivatives at most.
    assert trace.spent - trace.evaluations[-1] <= 1


@pytest.mark.parametrize("seed", range(3))
def test_least_squares_from_random_starts_meet_the_reference(foil, seed):
    objective, reference = foil
    aim = target_value(reference, 1e-8)
    assert minimise("least-squares", objective, evaluations=4000, seed=seed, target=aim).best <= aim


def test_evolution_over_the_nonlinear_coordinates_meets_the_reference(foil):
    objective, reference = foil
    aim = target_value(reference, 1e-8)
    trace = minimise("evolution", SeparableObjective(objective), evaluations=40_000, seed=0, target=aim)
    assert relative_gap(trace.best, reference) <= 1e-8


def test_seeds_hold_in_threads_too(foil):
    """The random numbers of nlopt belong to a thread; a run seeds them where it runs."""
    traces = []
    for _ in range(2):
        thread = threading.Thread(
            target=lambda: traces.append(minimise("crs2", foil[0], evaluations=200, seed=9))
        )
        thread.start()
        thread.join()
    here = minimise("crs2", foil[0], evaluations=200, seed=9)
    assert {t.objective.tobytes() for t in traces} == {here.objective.tobytes()}


def test_costs_of_targets_come_from_the_trace(foil):
    trace = minimise("random", foil[0], evaluations=300, seed=0)
    for place in (0, len(trace.objective) - 1):
        E = trace.objective[place]
        assert trace.cost_to(E) == (trace.evaluations[place], trace.seconds[place])
    assert trace.cost_to(trace.objective[0] * 1.001)[0] == trace.evaluations[0]
    assert trace.cost_to(0.0) == (np.inf, np.inf)


def test_a_budget_cuts_a_population(foil):
    recorder = Recorder(foil[0], 10)
    q = np.random.default_rng(0).uniform(recorder.lower, recorder.upper, (16, 6))
    with pytest.raises(Finished):
        recorder.values(q)
    assert recorder.spent == 10
    assert recorder.best == foil[0].values(q[:10]).min()
    with pytest.raises(Finished):
        recorder.value(q[0])


def test_derivatives_cost_as_much_as_a_value(foil):
    recorder = Recorder(foil[0], 10)
    q = 0.5 * (recorder.lower + recorder.upper)
    recorder.value(q)
    assert recorder.spent == 1
    recorder.value_and_gradient(q)
    assert recorder.spent == 3
    recorder.residuals(q)
    assert recorder.spent == 4
    recorder.residual_jacobian(q)
    assert recorder.spent == 5


@pytest.mark.parametrize("name", ["crs2", "isres", "esch", "mlsl-bobyqa", "mlsl-lbfgs", "ags", "direct"])
def test_nlopt_is_stopped_and_not_only_starved(foil, name, monkeypatch):
    asked = []

    def finished(self, q):
        asked.append(q)
        raise Finished

    monkeypatch.setattr(Recorder, "value", finished)
    monkeypatch.setattr(Recorder, "value_and_gradient", finished)
    OPTIMIZERS[name].run(Recorder(foil[0], 1000), 1)
    assert len(asked) < 100  # CRS2 fills its population of 70 first


def test_time_ends_a_run(foil):
    assert minimise("random", foil[0], evaluations=10**6, seconds=0.0).spent <= 64


def test_nothing_warns(foil):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for name in OPTIMIZERS:
            minimise(name, foil[0], evaluations=60)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"name": "guess"}, "no optimizer is called 'guess'; there are crs2, "),
        ({"evaluations": 0}, "evaluations is 0"),
        ({"seed": -1}, "seed is -1"),
    ],
)
def test_arguments_are_checked(foil, changes, said):
    with pytest.raises(InputError, match=said):
        minimise(**{"name": "crs2", "objective": foil[0], "evaluations": 10, **changes})


def test_derivatives_are_asked_for_where_there_are_none(foil):
    with pytest.raises(InputError, match="mlsl-lbfgs uses derivatives"):
        minimise("mlsl-lbfgs", SeparableObjective(foil[0]), evaluations=10)
