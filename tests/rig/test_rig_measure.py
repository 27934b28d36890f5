"""What a measurement on the emulated rig gives: physics, effect by effect."""

import dataclasses

import numpy as np
import pytest
from rig_helpers import emulation, write_plan

from clbrdf.geometry import cos_deg
from clbrdf.models import get_model
from clbrdf.rig.budget import POINTS_ONLY
from clbrdf.rig.calibrate import calibrate, resampling
from clbrdf.rig.kinematics import forward
from clbrdf.rig.measure import measure
from clbrdf.rig.rawscan import read_raw
from clbrdf.rig.row import DARK, DIRECT, POINT
from clbrdf.scan import Scan


def model_values(scan, parameters=None):
    """(N, 1) of the reference evaluation."""
    model = get_model()
    vector = model.vector(parameters or {})
    return model.brdf(vector[None, None, :], model.features(scan.directions))[0][:, None]


def whole_covariance(scan):
    """(N W, N W), 1/sr², of all components together."""
    angles = {name: getattr(scan, name) for name in ("theta_i", "theta_r", "phi_r")}
    (n, w), out = scan.brdf.shape, 0.0
    for one in scan.components:
        u = one.absolute(model_values(scan) * np.ones((1, scan.brdf.shape[1])))
        over_directions = one.direction_coefficients(angles)
        over_wavelengths = one.wavelength.coefficients(scan.wavelength)
        out = out + np.einsum("nw,nm,wv,mv->nwmv", u, over_directions, over_wavelengths, u)
    return out.reshape(n * w, n * w)


def quantisation_bound(raw, scan):
    """Largest error (N, W) that rounding counts, darks and direct beam to whole numbers can make.

    Each net count is off by at most 1 (half a count of light, half of dark), the direct beam's as well;
    a bin averages pixels, so its relative error is at most the mean of theirs.
    """
    rows = raw.point_rows()
    table = raw.rows
    counts = table["counts"].astype(float)
    direct = table["direct"][rows]
    signal = counts[rows] - counts[table["dark"][rows]]
    incident = counts[direct] - counts[table["dark"][direct]]
    weights = resampling(raw.wavelength, scan.wavelength, raw.plan.wavelength.step)
    relative = (1.0 / signal + 1.0 / incident) @ weights.T
    return model_values(scan) * relative * 1.01


def run(tmp_path, plan, budget=POINTS_ONLY, **options):
    with emulation(tmp_path, **options) as (rig_path, _, emulated):
        out = tmp_path / "scan.h5"
        measure(plan, rig_path, out, budget=budget)
        return Scan.open(out), read_raw(out), emulated


def test_all_effects_off_is_the_model_within_quantisation(tmp_path):
    scan, raw, _ = run(tmp_path, write_plan(tmp_path, step=5.0))
    assert len(scan.theta_i) == 26
    error = np.abs(scan.brdf - model_values(scan))
    bound = quantisation_bound(raw, scan)
    assert (error <= bound).all()
    assert np.median(bound / scan.brdf) < 2e-3, "the bound itself says something"
    assert scan.flag_counts() == {}


def test_out_of_plane(tmp_path):
    plan = write_plan(tmp_path)
    plan.write_text(
        "theta_i = [40]\ntheta_r = [20, 40, 60]\nregion = 'hemispherical'\nphi_r = [20, 100, 170, 190, 300]\n"
        "wavelength = {start = 500, stop = 600, step = 20}"
    )
    scan, raw, _ = run(tmp_path, plan)
    assert sorted(set(np.round(scan.phi, 2))) == [20, 100, 170, 190, 300]
    assert (np.abs(scan.brdf - model_values(scan)) <= quantisation_bound(raw, scan)).all()


def test_noise_on_pulls_are_standard(tmp_path):
    effects = "shot_noise = true\nread_noise = 3.0\nreference_noise = 0.002"
    plan = write_plan(tmp_path, step=2.5, reference_every=10)
    scan, _, _ = run(tmp_path, plan, effects=effects, reference_noise=0.002, seed=5)
    # Readings of the lamp's power are common to a row, those of the direct beam to ten rows, darks to a run:
    # of pulls as they are the standard deviation scatters by 0.06 from seed to seed, and darks are taken by
    # the clock, so that no seed makes two runs alike. Freed of what the components say they have in common,
    # they are 550 normal numbers, whose root mean square scatters by 1/√(2 · 550) = 0.03; four of that.
    pulls = np.linalg.solve(
        np.linalg.cholesky(whole_covariance(scan)), (scan.brdf - model_values(scan)).ravel()
    )
    assert pulls.size == 50 * 11
    assert np.sqrt(np.mean(pulls**2)) == pytest.approx(1.0, abs=0.12)
    # Their mean scatters by 1/√550 = 0.043.
    assert abs(np.mean(pulls)) < 0.18


@pytest.mark.soak
def test_noise_on_pulls_are_standard_with_many_points(tmp_path):
    effects = "shot_noise = true\nread_noise = 3.0\nreference_noise = 0.002"
    plan = write_plan(tmp_path, step=1.0, reference_every=5, more="repeats = 6")
    scan, _, _ = run(tmp_path, plan, effects=effects, reference_noise=0.002, seed=6)
    pulls = (scan.brdf - model_values(scan)) / scan.sigma
    assert np.std(pulls) == pytest.approx(1.0, abs=0.05)
    for theta_i in (30.0, 45.0):
        assert np.std(pulls[np.round(scan.theta_i, 6) == theta_i]) == pytest.approx(1.0, abs=0.1)


@pytest.mark.soak
def test_angle_errors_give_standard_pulls(tmp_path):
    """Stages that stop a little off: the slope of the BRDF carries it into the uncertainty."""
    budget = POINTS_ONLY.model_copy(update={"points": POINTS_ONLY.points.model_copy(update={"angle": 0.05})})
    broad = "parameters = {c = -30, d = 1.0}"
    plan = write_plan(tmp_path, step=1.0, more="repeats = 2")
    plan.write_text(plan.read_text().replace("[30, 45]", "{start = 28, stop = 32, step = 1}"))
    effects = "angle_noise = 0.05\nshot_noise = true\nread_noise = 3.0"
    scan, _, _ = run(tmp_path, plan, budget, effects=effects, emulator=broad, seed=8)
    pulls = (scan.brdf - model_values(scan, {"c": -30.0, "d": 1.0})) / scan.sigma
    assert np.std(pulls) == pytest.approx(1.0, abs=0.15)


def test_lamp_drift_is_carried_by_the_reference_power(tmp_path):
    plan = write_plan(tmp_path, reference_every=1000)
    with emulation(tmp_path, effects="lamp_drift = 0.1") as (rig_path, _, _):
        rig_path.write_text(rig_path.read_text().replace("band = 0.05", "band = 0.9"))
        measure(plan, rig_path, tmp_path / "scan.h5", budget=POINTS_ONLY)
    scan, raw = Scan.open(tmp_path / "scan.h5"), read_raw(tmp_path / "scan.h5")
    power = raw.rows["reference_power"][raw.rows["kind"] == POINT]
    assert power.max() / power.min() > 1.002, "the lamp did drift"
    drift = np.abs(np.diff(power)).max() / power.mean()
    error = np.abs(scan.brdf / model_values(scan) - 1.0)
    assert (error <= quantisation_bound(raw, scan) / scan.brdf + drift).all()


def test_nonlinearity_is_divided_out(tmp_path):
    polynomial = (0.97, 4.0e-6, -1.0e-10)
    effects = f"nonlinearity = {list(polynomial)}"
    scan, raw, _ = run(tmp_path, write_plan(tmp_path), effects=effects)
    assert raw.nonlinearity == pytest.approx(polynomial, rel=1e-6)
    error = np.abs(scan.brdf / model_values(scan) - 1.0)
    assert (error <= 1.2 * quantisation_bound(raw, scan) / scan.brdf).all()
    linear = calibrate(dataclasses.replace(raw, nonlinearity=np.empty(0)), POINTS_ONLY)
    assert np.abs(linear.brdf / model_values(scan) - 1.0).max() > 0.005, "without it the values are off"


def test_dark_drift_is_followed_by_fresh_darks(tmp_path):
    plan = write_plan(tmp_path, time=0.5, dark_every=1)
    scan, raw, _ = run(tmp_path, plan, effects="dark_drift = 0.5")
    kinds = raw.rows["kind"]
    assert np.count_nonzero(kinds == DARK) >= np.count_nonzero(kinds == POINT)
    darks = raw.rows["dark"][raw.point_rows()]
    assert len(set(darks.tolist())) == len(darks), "each row has its own dark"
    # 20 dark counts a second may have grown a little between a point and its dark.
    assert np.abs(scan.brdf / model_values(scan) - 1.0).max() < 0.02


def test_stray_light_is_an_effect_of_its_own(tmp_path):
    share = 0.02
    scan, raw, emulated = run(tmp_path, write_plan(tmp_path), effects=f"stray_light = {share}")
    # Both beams get it alike: the surface is grey, so the ratio does not change.
    assert (np.abs(scan.brdf - model_values(scan)) <= quantisation_bound(raw, scan)).all()
    direct = raw.rows["kind"] == DIRECT
    counts = raw.rows["counts"][direct][0].astype(float) - 1500.0
    lamp = emulated.world._direct / emulated.world._direct.max()
    shape = lamp + share * lamp.mean()
    assert counts / counts.max() == pytest.approx(shape / shape.max(), abs=2e-3)


def test_spectral_parameters_and_the_grid(tmp_path):
    emulator = "parameters = {ks = 0.0, kd = [[300, 0.5], [900, 1.1]]}"
    scan, _, _ = run(tmp_path, write_plan(tmp_path), emulator=emulator)
    diffuse = (0.5 + 0.001 * (scan.wavelength - 300.0)) / np.pi
    # A straight line is its own average over a bin, up to the lattice of pixels.
    assert scan.brdf == pytest.approx(np.broadcast_to(diffuse, scan.brdf.shape), rel=2e-3)


def test_a_scan_as_the_surface(tmp_path):
    surface = Scan(
        np.repeat([30.0, 45.0], 2),
        np.zeros(4),
        np.tile([20.0, 40.0], 2),
        np.full(4, 180.0),
        [400.0, 700.0],
        np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0], [7.0, 8.0]]),
    )
    surface.save(tmp_path / "surface.h5")
    plan = write_plan(tmp_path, step=20.0)
    plan.write_text(plan.read_text().replace("start = 0, stop = 60", "start = 20, stop = 40"))
    scan, _, _ = run(tmp_path, plan, emulator='scan = "surface.h5"')
    order = np.lexsort((scan.theta_r, scan.theta_i))
    middle = scan.brdf[order][:, scan.wavelength == 550.0][:, 0]
    assert middle == pytest.approx([1.5, 3.5, 5.5, 7.5], rel=2e-3)


def test_angles_are_those_read_back(tmp_path):
    scan, raw, _ = run(tmp_path, write_plan(tmp_path))
    rows = raw.point_rows()
    pose = forward(raw.rows["axes"][rows])
    assert scan.theta_i == pytest.approx(pose.theta_i, abs=1e-9)
    assert scan.theta_r == pytest.approx(raw.directions.theta_r, abs=2e-4)
    assert cos_deg(scan.theta_r).min() > 0.4


def test_file_is_whole_and_the_folder_gone(tmp_path):
    scan, raw, _ = run(tmp_path, write_plan(tmp_path))
    assert not (tmp_path / "scan.h5.run").exists()
    assert not (tmp_path / "scan.h5.lock").exists()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["plan.toml", "ports", "rig.toml", "scan.h5"]
    assert "14 points, new" in raw.log
    assert scan.provenance["instruments"].startswith("stages: SMC_CC_2.0.1")
    times = [bytes(t).decode() for t in raw.rows["time"][raw.point_rows()]]
    assert times == sorted(times)
    assert all(t[-6] in "+-" for t in times), "times carry a zone"


def test_saturation_shortens_a_fixed_time(tmp_path):
    scan, raw, _ = run(tmp_path, write_plan(tmp_path, time=0.5))
    seconds = raw.rows["integration_time"][raw.point_rows()]
    assert seconds.max() == 0.5
    assert seconds.min() < 0.5, "the peak had to be measured with a shorter time"
    assert "saturation" in raw.log
    assert scan.flag_counts() == {}


def test_saturated_at_the_shortest_time_is_flagged(tmp_path):
    plan = write_plan(tmp_path, more="shortest_time = 0.1\nlongest_time = 0.1")
    with emulation(tmp_path, emulator="") as (rig_path, _, _):
        rig_path.write_text(rig_path.read_text().replace("direct_rate = 1.0e8", "direct_rate = 1.0e5"))
    with emulation(tmp_path) as (rig_path, _, emulated):
        emulated.world._direct *= 1.4e-3
        measure(plan, rig_path, tmp_path / "scan.h5", budget=POINTS_ONLY)
        # The direct beam fits, a peak of 350 1/sr times 1e-3 sr does not pass it: nothing saturates.
        assert Scan.open(tmp_path / "scan.h5").flag_counts() == {}
