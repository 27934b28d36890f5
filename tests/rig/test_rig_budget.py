"""The error budget (3) to (7), and the uncertainty of each point."""

import dataclasses
import math

import numpy as np
import pytest
from rig_helpers import emulation, write_plan

from clbrdf.errors import InputError
from clbrdf.geometry import Directions
from clbrdf.models import get_model
from clbrdf.rig.budget import (
    GROUPS,
    KINDS,
    POINTS_ONLY,
    Budget,
    ErrorSource,
    PointSources,
    group_percent,
    kind_percent,
    load_budget,
    total_percent,
)
from clbrdf.rig.calibrate import calibrate, resample, resampling, save_calibrated
from clbrdf.rig.kinematics import forward, inverse
from clbrdf.rig.measure import measure
from clbrdf.rig.planfile import WavelengthGrid
from clbrdf.rig.rawscan import read_raw
from clbrdf.rig.rigfile import SpectrometerSettings
from clbrdf.rig.row import POINT
from clbrdf.rig.samples import sample_path
from clbrdf.rig.uncertainty import MEDIAN_OF_THREE, angle_sigmas, count_variance, linearised, local_slopes
from clbrdf.scan import Scan

GRID = np.arange(500.0, 601.0, 10.0)


def test_the_papers_numbers():
    budget = Budget()
    assert [f"{group_percent(budget, g):.2f}" for g in GROUPS] == ["3.34", "1.08", "0.90", "4.84"]
    assert f"{total_percent(budget):.2f}" == "6.05"
    assert total_percent(budget) == pytest.approx(math.sqrt(3.34**2 + 1.17 + 0.81 + 4.84**2))


def test_scale_and_point_parts_are_apart():
    budget = Budget()
    parts = [kind_percent(budget, kind) for kind in KINDS]
    assert math.hypot(*parts) == pytest.approx(total_percent(budget))
    assert parts[1:] == [0.0, 0.4, pytest.approx(math.hypot(0.1, 0.4))]


def test_a_group_left_out_keeps_the_papers_values(tmp_path):
    path = tmp_path / "budget.toml"
    path.write_text('[[personal]]\nname = "one reader"\npercent = 0.0\n')
    budget = load_budget(path)
    assert total_percent(budget) == pytest.approx(math.sqrt(3.34**2 + 1.17 + 0.81))
    assert load_budget(None) == Budget()


def test_measured_sources_replace_their_percentage():
    budget = Budget(points=PointSources(counting=True, reference=False))
    assert budget.remaining("point") == pytest.approx(0.001)
    budget = Budget(points=PointSources(counting=False, reference=False))
    assert budget.remaining("point") == pytest.approx(math.hypot(0.001, 0.004))
    assert budget.remaining("run") == pytest.approx(0.004)


def test_count_variance():
    detector = SpectrometerSettings(electrons_per_count=2.0, read_noise=3.0, bias=1000.0)
    assert count_variance(np.array([900.0, 1000.0, 5000.0]), detector).tolist() == [9.0, 9.0, 2009.0]
    noisy = detector.model_copy(update={"relative_noise": 0.01})
    assert count_variance(np.array([5000.0]), noisy).tolist() == [2009.0 + 40.0**2]


def test_median_of_three_by_sampling():
    values = np.median(np.random.default_rng(0).standard_normal((3, 400_000)), axis=0)
    assert values.var() == pytest.approx(MEDIAN_OF_THREE, rel=0.01)


def test_linearised_against_finite_differences():
    net = np.array([10.0, 1000.0, 12000.0])
    coefficients = np.array([0.98, 3e-6, -1e-10])
    linear, slope = linearised(net, coefficients)
    assert linear == pytest.approx(net / (0.98 + 3e-6 * net - 1e-10 * net**2))
    step = 1e-3
    after, before = (linearised(net + s, coefficients)[0] for s in (step, -step))
    assert slope == pytest.approx((after - before) / (2 * step), rel=1e-6)
    assert linearised(net, np.empty(0))[0] is net


def test_resampling_weights():
    wavelength = 340.0 + 0.47 * np.arange(1024) - 2e-5 * np.arange(1024) ** 2
    grid = np.arange(400.0, 701.0, 5.0)
    weights = resampling(wavelength, grid, 5.0)
    assert weights.sum(axis=1) == pytest.approx(1.0)
    assert resample(np.ones((2, 1024)), weights) == pytest.approx(1.0)
    # A line keeps its value, a parabola gains step²/24 times its second derivative.
    assert resample(wavelength[None], weights)[0] == pytest.approx(grid, abs=0.02)
    assert resample(wavelength[None] ** 2, weights)[0] == pytest.approx(grid**2 + 25 / 12, abs=15.0)
    narrow = resampling(wavelength, np.array([500.0]), 0.01)
    assert np.count_nonzero(narrow) <= 2
    with pytest.raises(InputError, match="the spectrometer gives"):
        resampling(wavelength, np.array([340.0]), 5.0)
    with pytest.raises(InputError, match="does not increase"):
        resampling(wavelength[::-1], grid, 5.0)


def lattice(function, theta_i=(28.0, 30.0, 33.0), phi=(180.0,)):
    """A scan of f(θi, θr, φ) on a lattice, with the axes that belong to it."""
    i, r, p = (a.ravel() for a in np.meshgrid(theta_i, np.arange(5.0, 61.0, 5.0), phi, indexing="ij"))
    values = function(i, r, p)
    scan = Scan(i, np.zeros(len(i)), r, p, [500.0], values[:, None])
    return scan, inverse(Directions.relative(i, r, p))[:, 0]


def test_local_slopes_of_a_plane():
    scan, _ = lattice(lambda i, r, p: 5.0 + 0.03 * i - 0.02 * r + 0.01 * p, phi=(160.0, 170.0, 180.0))
    slopes = local_slopes(scan)[:, :, 0]
    assert slopes == pytest.approx(np.broadcast_to([[0.03], [-0.02], [0.01]], slopes.shape), abs=1e-9)


def test_local_slopes_without_neighbours():
    scan, _ = lattice(lambda i, r, p: 5.0 - 0.02 * r, theta_i=(30.0,))
    slopes = local_slopes(scan)[:, :, 0]
    assert slopes[0] == pytest.approx(0.02), "a lobe follows the mirror direction"
    assert slopes[1] == pytest.approx(-0.02)
    assert (slopes[2] == 0.0).all()
    scan, _ = lattice(lambda i, r, p: 5.0 - 0.02 * r + 1.0 * i, theta_i=(30.0, 45.0))
    assert local_slopes(scan)[0] == pytest.approx(0.02), "15° apart is no neighbour"
    lone = Scan([30.0], [0.0], [20.0], [180.0], [500.0], [[1.0]])
    assert (local_slopes(lone) == 0.0).all()


def test_angle_sigma_in_closed_form():
    """In plane θr = turn and θi = lamp − turn: f = p θi + q θr has σ² = δ² (p² + (q − p)²)."""
    scan, axes = lattice(lambda i, r, p: 5.0 + 0.03 * i - 0.02 * r)
    sigma = np.linalg.norm(angle_sigmas(scan, axes, 0.1), axis=0)
    assert sigma == pytest.approx(0.1 * math.hypot(0.03, -0.05), rel=1e-6)


@pytest.mark.parametrize(
    ("theta_i", "parameters", "tolerance"),
    [([29.5, 30.0, 30.5], {"c": -30.0, "d": 1.0}, 0.1), ([30.0], {}, 0.3)],
    ids=["neighbours in every angle", "the mirror rule on the flanks of a lobe"],
)
def test_angle_sigma_by_sampling_the_model(theta_i, parameters, tolerance):
    """Axes disturbed at random: the spread of the model is the uncertainty."""
    model = get_model()
    vector = model.vector(parameters)[None, None, :]

    def values(i, r, p):
        return model.brdf(vector, model.features(Directions.relative(i, r, p)))[0]

    i, r = (a.ravel() for a in np.meshgrid(theta_i, np.arange(5.0, 60.0, 0.5), indexing="ij"))
    scan = Scan(i, np.zeros(len(i)), r, np.full(len(i), 180.0), [500.0], values(i, r, 180.0)[:, None])
    axes = inverse(scan.directions)[:, 0]
    predicted = np.linalg.norm(angle_sigmas(scan, axes, 0.02), axis=0)[:, 0]
    random = np.random.default_rng(4)
    spread = []
    for _ in range(600):
        pose = forward(axes + 0.02 * random.standard_normal(axes.shape))
        spread.append(values(pose.theta_i, pose.theta_r, pose.phi_r - pose.phi_i))
    spread = np.std(spread, axis=0)
    chosen = (i == 30.0) & (spread > 0.3 * spread.max())
    assert np.count_nonzero(chosen) > 5
    assert np.median((predicted / spread)[chosen]) == pytest.approx(1.0, abs=tolerance)
    assert (predicted / spread)[chosen] == pytest.approx(1.0, abs=2.0 * tolerance)


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    folder = tmp_path_factory.mktemp("measured")
    effects = "shot_noise = true\nread_noise = 3.0\nreference_noise = 0.002"
    with emulation(folder, effects=effects, reference_noise=0.002) as (rig_path, _, _):
        measure(write_plan(folder, reference_every=6, dark_every=5), rig_path, folder / "scan.h5")
    return folder / "scan.h5"


def test_the_budget_lands_in_the_scan_file(measured):
    """With the paper's budget: every source is a component, together the total."""
    scan = Scan.open(measured)
    found = {one.name: one for one in scan.components}
    assert {"counting", "dark", "counting of the reference", "lamp power at the point"} <= found.keys()
    assert {"stray light", "nonlinearity", "solid angle of the receiver", "different readers"} <= found.keys()
    assert "lamp stability" not in found, "measured at each point"
    sizes = {name: one.absolute(scan.brdf) for name, one in found.items()}
    assert np.sqrt(sum(size**2 for size in sizes.values())) == pytest.approx(scan.sigma)
    common = [name for name, one in found.items() if one.direction.form == "systematic"]
    whole = np.sqrt(sum(sizes[name] ** 2 for name in common)) / scan.brdf
    assert whole == pytest.approx(np.sqrt(3.34**2 + 1.0 + 0.4**2 + 0.7**2 + 4.84**2) / 100.0)
    # Rows that share a dark spectrum share its error, and those that share a reading of the beam.
    raw = read_raw(measured)
    rows = raw.point_rows()
    for name, column in (("dark", "dark"), ("drift of the reflected luminance", "direct")):
        groups, shared = found[name].direction.groups, raw.rows[column][rows]
        assert ((groups[:, None] == groups) == (shared[:, None] == shared)).all()
        assert len(set(groups.tolist())) > 1


def test_raw_counts_calibrate_again(measured, tmp_path):
    raw = read_raw(measured)
    scan = Scan.open(measured)
    again = calibrate(raw, Budget())
    assert np.array_equal(again.brdf, scan.brdf)
    half = raw.rig.model_copy(
        update={"geometry": raw.rig.geometry.model_copy(update={"solid_angle": 5.0e-4})}
    )
    assert calibrate(dataclasses.replace(raw, rig=half), POINTS_ONLY).brdf == pytest.approx(2.0 * scan.brdf)
    coarse = raw.plan.model_copy(update={"wavelength": WavelengthGrid(start=520, stop=580, step=20)})
    other = dataclasses.replace(raw, plan=coarse)
    calibrated = calibrate(other, POINTS_ONLY)
    assert calibrated.wavelength.tolist() == [520.0, 540.0, 560.0, 580.0]
    save_calibrated(tmp_path / "again.h5", other, calibrated, POINTS_ONLY, overwrite=False)
    assert np.array_equal(Scan.open(tmp_path / "again.h5").brdf, calibrated.brdf)
    assert np.array_equal(read_raw(tmp_path / "again.h5").rows["counts"], raw.rows["counts"])


def test_stray_light_from_the_mean_signal(measured):
    raw = read_raw(measured)
    budget = POINTS_ONLY.model_copy(update={"points": PointSources(stray_light=0.01)})
    calibrated = calibrate(raw, budget)
    # The surface is grey: the direct beam has the spectrum of every signal.
    beam = int(raw.rows["direct"][raw.point_rows()[0]])
    net = raw.rows["counts"][beam].astype(float) - raw.rows["counts"][raw.rows["dark"][beam]]
    share = 0.01 * resample((net.mean() / np.maximum(net, 1.0))[None], resampling(raw.wavelength, GRID, 10.0))
    stray = next(one for one in calibrated.components if one.name == "stray light")
    relative = np.asarray(stray.values) / calibrated.brdf
    assert relative == pytest.approx(np.broadcast_to(share, relative.shape), rel=0.05)


def test_calibration_works_on_what_is_there(measured):
    """Points that are not measured (yet) are left out; those that are there keep their own directions."""
    raw = read_raw(measured)
    whole = calibrate(raw, POINTS_ONLY)
    last = int(np.nonzero(raw.rows["kind"] == POINT)[0][-1])
    fewer = dataclasses.replace(raw, rows={name: values[:last] for name, values in raw.rows.items()})
    part = calibrate(fewer, POINTS_ONLY)
    assert len(part.theta_i) == len(whole.theta_i) - 1
    assert np.array_equal(part.brdf, whole.brdf[:-1])
    assert np.array_equal(fewer.directions.theta_r, raw.directions.theta_r[:-1])
    none = dataclasses.replace(raw, rows={name: values[:1] for name, values in raw.rows.items()})
    with pytest.raises(InputError, match="no point is measured"):
        calibrate(none, POINTS_ONLY)


def test_a_scan_without_raw_counts(tmp_path):
    Scan([30.0], [0.0], [30.0], [180.0], [550.0], [[0.3]]).save(tmp_path / "scan.h5")
    with pytest.raises(InputError, match="carries no raw counts"):
        read_raw(tmp_path / "scan.h5")


def test_sample_budget_is_the_papers_in_structure():
    budget = load_budget(sample_path("budget.toml"))
    assert total_percent(budget) < 1.0
    assert ErrorSource(name="x", percent=1.0).kind == "scale"
