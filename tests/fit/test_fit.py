"""The fit: at the global optimum, the same twice, whatever the blocks; and what it says of hard cases."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import clbrdf
from clbrdf import Fit, InputError, Scan
from clbrdf.fit import AnnealSettings, DictionarySettings, TemperingSettings
from clbrdf.fit.blocks import wavelength_blocks
from clbrdf.scans import sample_scan
from tests.coating import MADE
from tests.reference import naive

SHORT = AnnealSettings(chains=32, levels=15, starts=16)

# Above the best E of 40 restarts of bounded least squares: one and the same optimum, up to where both stop.
ALLOWED = 1e-6


def noisy(scan: Scan, relative: float, seed: int = 3) -> Scan:
    noise = np.random.default_rng(seed).standard_normal(scan.brdf.shape)
    return replace(scan, brdf=scan.brdf * (1.0 + relative * noise))


@pytest.mark.parametrize("name", ["yellow_tin_foil", "black_ceramic_tile"])
@pytest.mark.parametrize("places", [slice(0, 159, 40), slice(19, 159, 40)], ids=["even", "odd"])
def test_sample_scans_end_at_the_best_of_40_restarts(name, places):
    scan = Scan.open(sample_scan(name)).columns(places)
    fit = clbrdf.fit(scan)
    for k, E in enumerate(fit.objective):
        best = naive.multi_start(scan, k)
        assert best * (1 - 1e-6) <= naive.objective(fit.vector[k], scan, k) == pytest.approx(E, rel=1e-9)
        assert best * (1 + ALLOWED) >= E


IN_PLANE = ("nite_on_invar", "opticalblackanodize_on_al", "titaniumanodize_on_ti", "z307_on_al")


@pytest.mark.parametrize("sample", [MADE, *IN_PLANE])
def test_coatings_end_at_the_best_of_40_restarts(coating, sample):
    scan = coating("black_coatings_in_plane.csv", sample)
    scan = scan.columns([2]) if sample == MADE else scan  # the others, in test_every_optimum.py
    fit = clbrdf.fit(scan)
    assert set(fit.status.tolist()) <= {"converged", "at bound"}
    for k, E in enumerate(fit.objective):
        assert naive.multi_start(scan, k) * (1 + ALLOWED) >= E


def test_exact_data_give_exact_parameters_back(small_scan, device):
    scan = small_scan.columns([1])
    fit = clbrdf.fit(scan, settings=SHORT, device=device)
    # E is quadratic in the deviation, and double precision ends at about 1e-30.
    assert fit.objective[0] < 1e-24
    np.testing.assert_allclose(fit.vector[0], naive.TIN_FOIL, rtol=1e-9)
    assert fit.status.tolist() == ["converged"]


def test_the_end_is_a_stationary_point(small_scan):
    """Gradient of E by each free coordinate, seen as a cosine: 0 at a stationary point."""
    scan = noisy(small_scan, 0.06)
    fit = clbrdf.fit(scan, settings=SHORT)
    x = fit.model.features(scan.directions)
    for k in range(3):
        residual = fit.model.brdf(fit.vector[k][None, :], x) - scan.brdf[:, k]
        jacobian = fit.model.jacobian(fit.vector[k][None, :], x)
        cosines = residual @ jacobian / (np.linalg.norm(residual) * np.linalg.norm(jacobian, axis=0))
        free = np.array([np.isfinite(fit.sigma[name][k]) for name in fit.model.names])
        assert free.sum() >= 5
        # The stop rule allows a predicted gain of 1e-14 E: cosines up to its root.
        assert np.abs(cosines[free]).max() < 1e-6


def test_bytes_do_not_depend_on_who_still_holds_a_dataset(small_scan, tmp_path, monkeypatch):
    """A profiler, or a traceback, keeps locals of a frame alive: HDF5 then closes what they are later."""
    import h5py

    fit = clbrdf.fit(small_scan)
    fit.save(tmp_path / "a")
    made = []

    def held(create):
        def method(*args, **kwargs):
            made.append(create(*args, **kwargs))
            return made[-1]

        return method

    for name in ("create_dataset", "create_group"):
        monkeypatch.setattr(h5py.Group, name, held(getattr(h5py.Group, name)))
    fit.save(tmp_path / "b")
    assert len(made) > 10
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_the_same_seed_gives_the_same_bytes_and_another_seed_the_same_optimum(small_scan, tmp_path):
    scan = noisy(small_scan, 0.06)
    for name, seed in (("a", 5), ("b", 5), ("c", 6)):
        clbrdf.fit(scan, seed=seed, settings=SHORT).save(tmp_path / name)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
    first, other = Fit.open(tmp_path / "a"), Fit.open(tmp_path / "c")
    assert (first.search.acceptance != other.search.acceptance).any()
    np.testing.assert_allclose(first.objective, other.objective, rtol=1e-10)


@pytest.mark.parametrize(
    "settings",
    [SHORT, TemperingSettings(rounds=10), DictionarySettings()],
    ids=["anneal", "tempering", "dictionary"],
)
def test_blocks_and_neighbours_do_not_change_a_wavelength(small_scan, monkeypatch, settings):
    import sys

    scan = noisy(small_scan, 0.06)
    whole = clbrdf.fit(scan, settings=settings)
    monkeypatch.setattr(sys.modules["clbrdf.fit.blocks"], "BLOCK_BYTES", 1)
    assert len(wavelength_blocks(np.arange(3), *settings.cost(48, 6))) == 3
    blocks = clbrdf.fit(scan, settings=settings)
    alone = clbrdf.fit(scan.columns([1]), settings=settings)
    assert (whole.vector == blocks.vector).all()
    assert (whole.vector[1] == alone.vector[0]).all()


def test_blocks_keep_memory_bounded_whatever_the_scan():
    for w, n in ((3, 100), (4096, 774), (10, 10_000_000)):
        blocks = wavelength_blocks(np.arange(w), *AnnealSettings().cost(n, 6))
        assert np.concatenate(blocks).tolist() == list(range(w))
        largest = max(len(block) for block in blocks)
        assert largest == 1 or 24 * n * largest <= 128 << 20


def test_masked_values_have_no_say(small_scan):
    scan = noisy(small_scan, 0.06)
    spoiled = scan.brdf.copy()
    spoiled[10:14, :] *= 1e6
    flags = np.zeros(spoiled.shape, np.uint32)
    flags[10:14, :] = 1 << 5
    masked = replace(scan, brdf=spoiled, flags=flags, flag_names=(*scan.flag_names, "saturated"))
    flags_only = replace(masked, brdf=scan.brdf)
    a, b = (clbrdf.fit(s, settings=SHORT) for s in (masked, flags_only))
    assert (a.vector == b.vector).all()


def test_a_wavelength_without_data_is_said_and_the_others_are_fitted(small_scan):
    flags = np.zeros(small_scan.brdf.shape, np.uint32)
    flags[:, 1] = 1
    fit = clbrdf.fit(replace(small_scan, flags=flags), settings=SHORT)
    assert fit.status.tolist() == ["converged", "no data", "converged"]
    assert np.isnan(fit.vector[1]).all()
    assert np.isfinite(fit.vector[[0, 2]]).all()
    assert np.isnan(fit.objective[1])


def test_nothing_to_fit_is_refused(small_scan):
    scan = replace(small_scan, flags=np.ones(small_scan.brdf.shape, np.uint32))
    with pytest.raises(InputError, match=r"all 144 values are masked \(not_measured 144\)"):
        clbrdf.fit(scan)


def test_one_direction_is_fitted_and_called_ambiguous():
    scan = Scan([30.0], 0.0, [30.0], 180.0, [550.0], [[2.0]])
    fit = clbrdf.fit(scan, settings=SHORT)
    assert fit.status.tolist() == ["ambiguous"]
    assert fit.objective[0] < 1e-20
    assert not np.isfinite(fit.sigma["ks"][0])


def test_constant_data_are_a_diffuse_surface_without_a_lobe(small_scan):
    scan = replace(small_scan, brdf=np.full(small_scan.brdf.shape, 0.25))
    fit = clbrdf.fit(scan)
    assert (fit.objective < 1e-12).all()
    np.testing.assert_allclose(fit.evaluate(), 0.25, rtol=1e-5)
    assert set(fit.status.tolist()) <= {"ambiguous", "at bound"}


def test_two_incident_angles_cannot_tell_ks_a_and_b_apart(small_scan):
    rows = np.flatnonzero(small_scan.theta_i != 60.0)
    scan = Scan(
        *(getattr(small_scan, n)[rows] for n in ("theta_i", "phi_i", "theta_r", "phi_r")),
        small_scan.wavelength,
        noisy(small_scan, 0.02).brdf[rows],
    )
    fit = clbrdf.fit(scan, settings=SHORT)
    for k in range(3):
        if fit.status[k] == "ambiguous":
            assert [n for n in fit.model.names if np.isinf(fit.sigma[n][k])] == ["a", "b", "ks"]
        else:  # one of the three has run to a limit and holds the others
            assert fit.status[k] == "at bound"


def test_bounds_are_kept_and_said(small_scan):
    fit = clbrdf.fit(small_scan, bounds={"d": (0.8, 1.0), "ks": (1.0, 400.0)}, settings=SHORT)
    assert (fit.parameters["d"] >= 0.8).all()
    assert (fit.parameters["ks"] <= 400.0).all()
    assert (fit.parameters["d"] == 0.8).any()
    assert "at bound" in fit.status.tolist()
    at = fit.parameters["d"] == 0.8
    assert np.isnan(fit.sigma["d"][at]).all()


@pytest.mark.parametrize("factor", [1e-9, 1e3])
def test_dark_and_bright_samples_fit_alike(small_scan, factor):
    scan = replace(noisy(small_scan, 0.06), sigma=None)
    scaled = replace(scan, brdf=scan.brdf * factor)
    # ks and kd scale with the sample; the limits go along so that it is the same problem.
    bounds = {"ks": (0.0, 1e5 * factor), "kd": (0.0, 10.0 * factor)}
    a, b = clbrdf.fit(scan), clbrdf.fit(scaled, bounds=bounds)
    np.testing.assert_allclose(b.objective, a.objective, rtol=1e-6)


def test_every_fit_reports_what_it_cost(small_scan, device):
    calls = []
    fit = clbrdf.fit(small_scan, settings=SHORT, device=device, report=lambda *c: calls.append(c))
    assert calls[-1][0] == calls[-1][1]
    moves = SHORT.chains * SHORT.levels * SHORT.sweeps * 6
    assert (fit.search.evaluations > moves).all()
    assert ((fit.search.acceptance > 0.1) & (fit.search.acceptance < 0.9)).all()
    assert (fit.search.not_finite >= 0).all()
    assert fit.search.seconds > 0.0
    assert fit.search.device == str(device)


def test_settings_and_arguments_are_checked(small_scan):
    with pytest.raises(
        InputError,
        match="no method is called 'guess'; there are auto, dictionary, lookup, anneal-",
    ):
        clbrdf.fit(small_scan, method="guess")
    with pytest.raises(InputError, match="method dictionary takes DictionarySettings, not AnnealSettings"):
        clbrdf.fit(small_scan, method="dictionary", settings=SHORT)
    with pytest.raises(InputError, match="seed is -1"):
        clbrdf.fit(small_scan, seed=-1)
    with pytest.raises(InputError, match="chains is 0; give 1 to 1000000"):
        AnnealSettings(chains=0)
    with pytest.raises(InputError, match="cooling factors"):
        AnnealSettings(slowest=1.5)


def test_file_round_trip_is_exact(small_scan, tmp_path):
    fit = clbrdf.fit(noisy(small_scan, 0.06), weights="sigma", settings=SHORT)
    fit.save(tmp_path / "fit.h5")
    again = Fit.open(tmp_path / "fit.h5")
    for record in ("setup", "estimate", "goodness", "search"):
        for name, value in vars(getattr(fit, record)).items():
            if isinstance(value, np.ndarray):
                assert value.tobytes() == getattr(getattr(again, record), name).tobytes(), name
    for name in fit.model.names:
        assert fit.parameters[name].tobytes() == again.parameters[name].tobytes()
        assert fit.sigma[name].tobytes() == again.sigma[name].tobytes()
    assert (fit.provenance, fit.model) == (again.provenance, again.model)
    assert (fit.setup.method, fit.setup.seed) == (again.setup.method, again.setup.seed)
    assert fit.search.device == again.search.device
    assert (fit.status == again.status).all()
    assert again.scan.brdf.tobytes() == fit.scan.brdf.tobytes()
    assert (again.evaluate() == fit.evaluate()).all()
    assert Scan.open(tmp_path / "fit.h5").sample == "foil"


def test_a_scan_is_no_fit(small_scan, tmp_path):
    small_scan.save(tmp_path / "scan.h5")
    with pytest.raises(InputError, match=r"scan\.h5: holds a scan, and a fit is needed here"):
        Fit.open(tmp_path / "scan.h5")
