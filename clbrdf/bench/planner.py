"""Adaptive plans beside uniform ones: points and seconds until a parameter is known.

The light is simulated: the planner is the one that `clbrdf measure` runs, with its rows calibrated already. A
point's value is the surface's, with normal noise of the size that the rig's noise model gives it. Travel and
exchanges cost what the rig file says.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import as_file, files

import numpy as np
import numpy.typing as npt

from clbrdf.geometry import Directions, cos_deg
from clbrdf.models import get_model
from clbrdf.progress import Report, silent
from clbrdf.rig.adaptive.candidates import CandidatePoints, make_candidates
from clbrdf.rig.adaptive.goal import Goal
from clbrdf.rig.adaptive.knowledge import Knowledge, learn
from clbrdf.rig.adaptive.light import NoiseModel
from clbrdf.rig.adaptive.observe import CalibratedPoint
from clbrdf.rig.adaptive.planner import AdaptivePlanner
from clbrdf.rig.adaptive.settings import Adaptive
from clbrdf.rig.budget import Budget, ErrorSource, PointSources
from clbrdf.rig.planfile import Plan
from clbrdf.rig.rigfile import Rig, load_rig
from clbrdf.rig.route import order_points, overhead, travel_times
from clbrdf.rig.row import NO_ROW, POINT, Row
from clbrdf.rig.stagesettings import AXES

Array = npt.NDArray[np.float64]

TARGETS = (0.005, 0.0015)
"""Relative standard uncertainties to reach, the coarse one first."""

WAVELENGTH = np.array([550.0])
"""One wavelength, nm: what several add is the same for both ways."""

NOISE = 1.0
"""Percent that differ from point to point."""

GROWTH = 1.1
"""Least ratio of neighbouring numbers of points that uniform plans are tried with."""

LARGEST_GROWTH = 1.4
"""Largest such ratio: with few points σ falls faster than as the root of their number."""

MOST = 3000
"""Points at which a uniform plan is given up."""


@dataclass(frozen=True)
class PlannedSurface:
    """What is measured and what is fitted to it.

    Attributes
    ----------
    name, model : str
        Of the surface, and of its model.
    parameters : dict of str to float
        Its parameters.
    fitted : str
        The model that the plan believes in.
    wanted : str
        Its parameter that has a target.
    power : float
        Its relative uncertainty is so many times that of the lobe's width, which the targets are of.
    """

    name: str
    model: str
    parameters: dict[str, float]
    fitted: str
    wanted: str
    power: float = 1.0

    @property
    def is_right(self) -> bool:
        """Whether the plan believes in the right model."""
        return self.model == self.fitted

    def values(self, directions: Directions) -> Array:
        """BRDF (1, N), 1/sr."""
        model = get_model(self.model)
        vector = np.atleast_2d(model.vector(self.parameters))[:, None, :]
        return np.asarray(model.brdf(vector, model.features(directions)))


SURFACES = (
    PlannedSurface(
        "narrow ggx",
        "ggx+lambert",
        {"ggx.alpha": 0.05, "ggx.F0": 0.3, "ggx.F90": 1.0, "lambert.rho": 0.2},
        "ggx+lambert",
        "ggx.alpha",
    ),
    PlannedSurface(
        "wang2013",
        "wang2013",
        {"a": 3.87, "b": 0.5216, "c": -300.0, "d": 0.74, "ks": 451.7958, "kd": 1.3034},
        "wang2013",
        "c",
        # exp[c (γ²/2)^d] falls to 1/e at γ ~ |c|^(−1/2d), with the d of this surface.
        2.0 * 0.74,
    ),
    PlannedSurface(
        "ggx as beckmann",
        "ggx+lambert",
        {"ggx.alpha": 0.15, "ggx.F0": 0.3, "ggx.F90": 1.0, "lambert.rho": 0.2},
        "beckmann+lambert",
        "beckmann.alpha",
    ),
)


@dataclass(frozen=True)
class PlanRun:
    """One plan on one surface with one seed.

    Attributes
    ----------
    surface, way : str
        "adaptive" or "uniform".
    seed : int
    target : float
    points : int
        Until the plan's own fit says that the target is reached; 0 where it never does.
    seconds : float
        Of the rig.
    z : float
        Deviation of the parameter from the truth in units of its uncertainty; NaN for a wrong model.
    chi2 : float
        Of the validation points in simulated light, NaN where there are none; of all on the emulated rig.
    reached : float
        Relative uncertainty that these points came to.
    """

    surface: str
    way: str
    seed: int
    target: float
    points: int
    seconds: float
    z: float
    chi2: float
    reached: float = float("nan")


class SimulatedLight:
    """An observer of points that were never measured."""

    def __init__(self, surface: PlannedSurface, plan: Plan, rig: Rig, seed: int) -> None:
        relative = ErrorSource(name="point", percent=NOISE, kind="point")
        budget = Budget(
            mechanical=(relative,), illumination=(), detection=(), personal=(), points=PointSources()
        )
        self.surface, self.seed = surface, seed
        rate, pixels = np.full(1, 1.0e8), np.full(1, 11.0)
        self.whole = NoiseModel(plan, rig, budget, rate, pixels, rig.spectrometer.bias, 15500.0)

    def light(self, row: Row, wavelength: Array) -> NoiseModel:
        """Return the light, always the same."""
        del row, wavelength
        return self.whole

    def row(self, number: int, nominal: Array) -> Row:
        """Return the row that a point would leave."""
        return Row(
            POINT,
            number,
            "",
            np.full(3, np.nan),
            1.0,
            float(self._noise(nominal)[1][0]),
            NO_ROW,
            NO_ROW,
            0,
            np.zeros(1, np.uint32),
            nominal,
        )

    def observe(self, row: Row) -> CalibratedPoint:
        """Return the surface's value with noise."""
        sigma, _ = self._noise(row.nominal)
        value = self.surface.values(_one(row.nominal))[:, 0]
        deviate = np.random.default_rng([self.seed, row.point]).standard_normal()
        measured = value + sigma[:, 0] * deviate
        return CalibratedPoint(row.nominal, WAVELENGTH, measured, sigma[:, 0] * np.abs(measured / value))

    def _noise(self, nominal: Array) -> tuple[Array, Array]:
        direction = _one(nominal)
        value = self.surface.values(direction)
        return self.whole.predict(value, np.zeros_like(value), cos_deg(direction.theta_r))


def _one(nominal: Array) -> Directions:
    return Directions(*(np.atleast_1d(angle) for angle in nominal))


def bench_plan(surface: PlannedSurface, target: float) -> Plan:
    """Return the plan: in plane, five incident angles, views every quarter of a degree."""
    return Plan(
        theta_i=(15.0, 30.0, 45.0, 60.0, 75.0),
        theta_r={"start": 0, "stop": 80, "step": 0.25},
        adaptive=Adaptive(
            model=surface.fitted,
            parameters=(surface.wanted,),
            sigma=target * surface.power,
            wavelengths=1,
            fix={"ggx.F90": 1.0} if surface.fitted.startswith("ggx") else FIXED.get(surface.fitted, {}),
        ),
    )


FIXED: dict[str, dict[str, float]] = {"beckmann+lambert": {"beckmann.F90": 1.0}}


def measure_adaptive(surface: PlannedSurface, rig: Rig, seed: int) -> list[PlanRun]:
    """Run the planner to the finest target; tell when it passed each."""
    plan = bench_plan(surface, TARGETS[-1])
    assert plan.adaptive is not None
    observer = SimulatedLight(surface, plan, rig, seed)
    planner = AdaptivePlanner(plan.adaptive, make_candidates(plan, rig), rig, observer, _quiet)
    while (target := planner.ask()) is not None:
        planner.tell(observer.row(target.number, target.nominal))
    runs = []
    for wanted in TARGETS:
        state = next((s for s in planner.states if s.reached <= wanted * surface.power), None)
        if state is None or state.knowledge is None:
            runs.append(PlanRun(surface.name, "adaptive", seed, wanted, 0, np.nan, np.nan, np.nan))
            continue
        z, chi2 = _z(surface, state.knowledge), state.knowledge.misfit.chi2
        runs.append(PlanRun(surface.name, "adaptive", seed, wanted, state.points, state.seconds, z, chi2))
    return runs


def _quiet(kind: str, text: str) -> None:
    del kind, text


def measure_uniform(surface: PlannedSurface, rig: Rig, seed: int) -> list[PlanRun]:
    """Take evenly spread views at each incident angle, more and more, until a fit reaches a target."""
    plan = bench_plan(surface, TARGETS[-1])
    assert plan.adaptive is not None
    candidates = make_candidates(plan, rig)
    observer = SimulatedLight(surface, plan, rig, seed)
    model, goal = get_model(surface.fitted), Goal(plan.adaptive, np.unique(candidates.directions.theta_i))
    random, runs = np.random.default_rng([seed, 1]), []
    targets, count = list(TARGETS), 16.0
    while targets and count <= MOST:
        places = _uniform(candidates, round(count), random)
        seen = [observer.observe(observer.row(k, candidates.nominal(p))) for k, p in enumerate(places)]
        knowledge = learn(plan.adaptive, model, seen, [], observer.whole)
        if knowledge is not None:
            reached = goal.reached(knowledge.cov, goal.metric(knowledge))
            while targets and reached <= targets[0] * surface.power:
                seconds, z = _seconds(candidates, places, observer, rig), _z(surface, knowledge)
                runs.append(
                    PlanRun(surface.name, "uniform", seed, targets.pop(0), len(places), seconds, z, np.nan)
                )
            # σ falls as the root of the number: the last steps to a target are small ones.
            missing = reached / (targets[0] * surface.power) if targets else 1.0
            count *= max(GROWTH, min(LARGEST_GROWTH, 0.7 * missing**2))
        else:
            count *= GROWTH
    return runs + [PlanRun(surface.name, "uniform", seed, t, 0, np.nan, np.nan, np.nan) for t in targets]


def _uniform(candidates: CandidatePoints, count: int, random: np.random.Generator) -> list[int]:
    """Return evenly spaced views, from a random phase, at every incident angle."""
    incident = np.unique(candidates.directions.theta_i)
    places: list[int] = []
    for k, angle in enumerate(incident):
        own = np.nonzero(candidates.directions.theta_i == angle)[0]
        signed = np.where(candidates.directions.phi == 180.0, 1.0, -1.0) * candidates.directions.theta_r
        own = own[np.argsort(signed[own], kind="stable")]
        share = count // len(incident) + (k < count % len(incident))
        steps = (np.arange(share) + random.uniform()) / max(share, 1) * len(own)
        places += own[steps.astype(int) % len(own)].tolist()
    return places


def _seconds(candidates: CandidatePoints, places: list[int], observer: SimulatedLight, rig: Rig) -> float:
    speeds = [getattr(rig.stages, name) for name in AXES]
    _, axes = order_points(candidates.axes[places], speeds, "shortest")
    exposures = np.array([observer.row(0, candidates.nominal(p)).integration_time for p in places])
    return rig_seconds(rig, axes, exposures)


def rig_seconds(rig: Rig, axes: Array, exposures: Array) -> float:
    """Return the time of points in their order, s: travel between rig angles (N, 3), exposures, exchanges."""
    speeds = [getattr(rig.stages, name) for name in AXES]
    travel = travel_times(np.diff(axes, axis=0, prepend=np.zeros((1, 3))), speeds).sum()
    return float(travel + exposures.sum() + len(axes) * overhead(rig))


def _z(surface: PlannedSurface, knowledge: Knowledge) -> float:
    if not surface.is_right:
        return float("nan")
    place = knowledge.model.names.index(surface.wanted)
    column = knowledge.free.index(place)
    off = knowledge.vector[0, place] - surface.parameters[surface.wanted]
    return float(off / np.sqrt(knowledge.cov[0, column, column]))


def sample_rig() -> Rig:
    """Return the rig whose speeds and noise count: the sample rig file."""
    with as_file(files("clbrdf.rig.samples").joinpath("rig.toml")) as path:
        return load_rig(path)


def sample_rig_text() -> str:
    """Return the sample rig file."""
    return files("clbrdf.rig.samples").joinpath("rig.toml").read_text(encoding="utf-8")


def measure_plans(rig: Rig, seeds: int, report: Report = silent) -> list[PlanRun]:
    """Measure every surface both ways with some seeds."""
    runs: list[PlanRun] = []
    total, done = len(SURFACES) * seeds, 0
    for surface in SURFACES:
        for seed in range(seeds):
            runs += measure_adaptive(surface, rig, seed) + measure_uniform(surface, rig, seed)
            done += 1
            report(done, total)
    return runs
