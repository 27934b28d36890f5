"""What a scan tells of its instrument beside solid angle and bandpass."""

from __future__ import annotations

import json
import pickle
from dataclasses import replace

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clbrdf import Fit, InputError, Scan
from clbrdf.cli import main
from clbrdf.instrument.settings import Instrument
from clbrdf.scan.effects import SETTINGS
from clbrdf.scene import simulate
from tests.scene.scenes import scene

LAMBERT = {"model": "lambert", "parameters": {"rho": 0.4}}
BEAM = {"beam": {"angle": 2.0, "focussed": True}}


def told(effects):
    return Scan([30.0, 40.0], 0.0, [10.0, 20.0], 180.0, [550.0], [[0.3], [0.4]], effects=effects)


def test_names_and_settings_are_those_of_an_instrument_file():
    for name, known in SETTINGS.items():
        kind = Instrument.model_fields[name].annotation.__args__[0]
        random = {"stage_i", "stage_r"} if name == "misalignment" else set()
        assert set(kind.model_fields) - random == set(known)
    assert set(SETTINGS) == set(Instrument.model_fields) - {"aperture", "bandwidth"}


numbers = st.floats(1e-3, 30.0)
EFFECTS = st.fixed_dictionaries(
    {},
    optional={
        name: st.fixed_dictionaries({key: numbers if unit else st.booleans() for key, unit in known.items()})
        for name, known in SETTINGS.items()
    },
)


@settings(max_examples=25, deadline=None)
@given(effects=EFFECTS)
def test_effects_stay_what_they_are(effects, tmp_path_factory):
    scan = told(effects)
    path = tmp_path_factory.mktemp("effects") / "scan.h5"
    scan.save(path)
    plain = {name: dict(values) for name, values in Scan.open(path).effects.items()}
    assert plain == effects
    assert {n: dict(v) for n, v in pickle.loads(pickle.dumps(scan)).effects.items()} == effects
    for part in (scan.rows([1]), scan.columns([0]), Scan.merge([scan, scan.rows([1])]), scan.averaged()):
        assert part.effects == scan.effects


def test_units_are_read(tmp_path):
    told({"beam": {"angle": 1.0}, "footprint": {"beam": 4.0, "field": 9.0}}).save(tmp_path / "a.h5")
    with h5py.File(tmp_path / "a.h5", "r+") as file:
        angle, beam = (file[f"entry/instrument/effects/{name}"] for name in ("beam/angle", "footprint/beam"))
        assert (angle.attrs["units"], beam.attrs["units"]) == ("deg", "mm")
        angle[...], angle.attrs["units"] = np.deg2rad(1.0), "rad"
        beam[...], beam.attrs["units"] = 4000.0, "um"
    again = Scan.open(tmp_path / "a.h5").effects
    assert again["beam"]["angle"] == pytest.approx(1.0, rel=1e-15)
    assert again["footprint"] == {"beam": pytest.approx(4.0, rel=1e-15), "field": 9.0}


@pytest.mark.parametrize(
    ("effects", "words"),
    [
        ({"lens": {}}, "'lens' is none that a scan tells of; known: misalignment, beam, footprint"),
        ({"beam": {"width": 1.0}}, "effects.beam: unknown 'width'; known: angle, focussed"),
        ({"beam": {"angle": np.nan}}, "effects.beam.angle is nan; give a number"),
        ({"beam": {"angle": "1"}}, "effects.beam.angle is '1'; give a number"),
    ],
)
def test_what_is_no_effect(effects, words):
    with pytest.raises(InputError, match=words):
        told(effects)


@pytest.mark.parametrize("name", ["lens", "beam/wobble"])
def test_a_file_that_tells_of_what_is_not_known_is_refused(tmp_path, name, capsys):
    told(BEAM).save(tmp_path / "a.h5")
    with h5py.File(tmp_path / "a.h5", "r+") as file:
        file["entry/instrument/effects"].create_group(name)
    assert main(["info", str(tmp_path / "a.h5")]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert f"{name.rpartition('/')[2]!r}" in error
    assert "which this version of clbrdf does not know; use a newer one" in error


def test_an_effect_that_cannot_be_is_refused_by_the_fit(tmp_path, capsys):
    told({"beam": {"angle": 90.0}}).save(tmp_path / "a.h5")
    status = main(["fit", str(tmp_path / "a.h5"), "-o", str(tmp_path / "b.h5"), "--model", "lambert"])
    error = capsys.readouterr().err
    assert (status, error.count("\n")) == (2, 1)
    assert "the scan file: beam.angle = 90" in error


def test_scans_of_different_effects_do_not_merge():
    with pytest.raises(InputError, match=r"different effects .*beam of angle 2°, focussed; none.* keep them"):
        Scan.merge([told(BEAM), replace(told(BEAM), effects={})])


def test_only_what_a_fit_can_take_out_is_told():
    effects = {"misalignment": {"tilt": 0.0, "height": 0.0}, "beam": {"angle": 1.0}, "lamp_drift": True}
    made = simulate(scene([20.0], 30.0, surface=LAMBERT, effects=effects))
    assert made.effects == {"beam": {"angle": 1.0, "focussed": False}}
    tilted = simulate(scene([20.0], 30.0, surface=LAMBERT, effects={"misalignment": {"tilt": 1.0}}))
    assert set(tilted.effects["misalignment"]) == {"tilt", "tilt_azimuth", "height", "distance"}


def test_a_simulated_scan_is_fitted_through_what_it_tells_of(tmp_path, capsys):
    text = """
        wavelength = 550
        [surface]
        model = "ggx+lambert"
        parameters = { "lambert.rho" = 0.3, "ggx.F0" = 0.1, "ggx.alpha" = 0.1 }
        [directions]
        theta_i = [20, 50]
        theta_r = { start = 0, stop = 70, step = 5 }
        phi_r = 180
        [effects]
        beam = { angle = 4 }
        footprint = { beam = 8, field = 10 }
        aperture = { angle = 2 }
    """
    (tmp_path / "scene.toml").write_text(text)
    scan, fit = tmp_path / "scan.h5", tmp_path / "fit.h5"
    assert main(["simulate", str(tmp_path / "scene.toml"), "-o", str(scan)]) == 0
    capsys.readouterr()
    assert main(["info", str(scan)]) == 0
    shown = capsys.readouterr().out
    assert "angle 4°" in shown
    assert "beam 8 mm, field 10 mm" in shown
    words = ["fit", str(scan), "-o", str(fit), "--model", "ggx+lambert", "--fix", "ggx.F90=1"]
    assert main(words) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "beam 4°, aperture 2°, footprint of 8 mm in a field of 10 mm, as the scan file says" in shown
    found = Fit.open(fit)
    assert found.parameters["ggx.alpha"][0] == pytest.approx(0.1, rel=1e-3)
    assert json.loads(found.through.instrument.model_dump_json())["beam"]["angle"] == 4.0
    assert main([*words, "--point", "--overwrite"]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "points; the beam, footprint and aperture that the scan tells of are left out" in shown
    assert Fit.open(fit).parameters["ggx.alpha"][0] > 0.103
