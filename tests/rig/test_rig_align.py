"""Alignment: errors of the axes and the sample's tilt from peaks; wavelengths from lines."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rig_helpers import emulation

from clbrdf.cli import main
from clbrdf.rig.align import align, fit_centre
from clbrdf.rig.emulator.settings import EmulatorSettings
from clbrdf.rig.emulator.world import Clock, World
from clbrdf.rig.errors import UnmendedError
from clbrdf.rig.lamplines import LINES, corrected, find_correction
from clbrdf.rig.rigfile import load_rig
from clbrdf.rig.samples import sample_path

GLOSSY = {"model": "ggx", "parameters": {"alpha": 0.03}}
ROUNDING = 1e-4 / np.sqrt(12.0)
"""What travels on the line has four decimals."""


def emulated_light(seed, errors, surface=GLOSSY):
    """Signal and its uncertainty at a pose, from the emulated light without instruments in between."""
    rig = load_rig(sample_path("rig.toml"))
    effects = {"shot_noise": True, "read_noise": 3.0, "zero_errors": errors, "beam_width": 0.4}
    emulator = EmulatorSettings.model_validate({"seed": seed, "effects": effects, **surface})
    world = World(rig, emulator, Clock(1e9))
    world.is_open = True
    here = [0.0, 0.0, 0.0]
    world.axes = lambda: tuple(here)

    def measure(axes):
        here[:] = [round(angle, 4) for angle in axes]
        seconds = min(1.0, 10_000 / max(float(np.max(world.rate())), 1e-9))
        net = world.counts(seconds, 0.0).astype(float) - 1500.0 - 20.0 * seconds
        variance = np.maximum(net, 0.0) / 2.0 + 9.0 + 1.0 / 12.0
        return tuple(here), net.sum() / seconds, np.sqrt(variance.sum()) / seconds

    return measure, rig.geometry.direct


def scores(count):
    """(count, 3) deviations in units of the stated σ, for errors of up to ±1° in every axis."""
    found = []
    for seed in range(count):
        errors = tuple(np.random.default_rng(seed).uniform(-1.0, 1.0, 3))
        result = align(*emulated_light(seed, errors), position=ROUNDING)
        estimates = (result.lamp, result.turn, result.pitch)
        found.append([(e.value - x) / e.sigma for e, x in zip(estimates, errors, strict=True)])
    return np.array(found)


def test_errors_are_found_within_their_uncertainty():
    z = scores(6)
    assert np.abs(z).max() < 4.0
    assert np.std(z) == pytest.approx(1.0, abs=0.45)


@pytest.mark.soak
def test_errors_are_found_within_their_uncertainty_200():
    z = scores(200)
    inside = (np.abs(z) < 1.0).mean()
    print(
        f"{inside:.1%} of {z.size} within 1 σ; by axis {(np.abs(z) < 1.0).mean(axis=0)}; std {z.std(axis=0)}"
    )
    assert inside == pytest.approx(0.68, abs=0.05)


@given(st.floats(-2.0, 2.0), st.floats(0.3, 3.0), st.floats(-0.2, 0.2), st.integers(0, 1000))
@settings(deadline=None, max_examples=30)
def test_centre_of_any_even_peak(centre, width, kurtosis, seed):
    """Gauss with a quartic term, noise of a thousandth: within five of its own σ."""
    random = np.random.default_rng(seed)
    x = centre + 0.1 * width + np.linspace(-width, width, 21)
    u = (x - centre) / width
    values = 1000.0 * np.exp(-(u**2) + kurtosis * u**4)
    sigmas = 1e-3 * values
    found = fit_centre(x, values + sigmas * random.standard_normal(21), sigmas, centre + 0.1 * width, 0.0)
    assert abs(found.value - centre) < 5.0 * found.sigma
    assert found.sigma < 0.01 * width


def test_a_matt_sample_has_no_peak():
    matt = {"parameters": {"ks": 0.0, "kd": 1.0}}
    measure, direct = emulated_light(1, (0.2, 0.3, -0.1), matt)
    flat = lambda axes: (axes, 1.0 if axes[0] < 170 else measure(axes)[1], 1e-3)  # noqa: E731
    with pytest.raises(UnmendedError, match=r"no peak stands out within 3°; put in a glossy sample"):
        align(flat, direct)


def test_the_command_on_the_emulated_rig(tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "100")
    effects = "shot_noise = true\nread_noise = 3.0\nzero_errors = [0.4, -0.7, 0.9]\nbeam_width = 0.4"
    emulator = 'model = "ggx"\nparameters = {alpha = 0.03}'
    out = tmp_path / "alignment.json"
    with emulation(tmp_path, effects=effects, emulator=emulator) as (rig_path, _, _):
        words = ["align", "--rig", str(rig_path), "--lamp", "60", "--step", "0.5", "--json", str(out)]
        assert main(words) == 0
    text = capsys.readouterr().out
    assert "zero to write" in text
    assert max(map(len, text.splitlines())) <= 100
    found = json.loads(out.read_text())
    for name, error in (("lamp", 0.4), ("turn", -0.7), ("pitch", 0.9)):
        assert found[name]["error"] == pytest.approx(error, abs=max(5 * found[name]["sigma"], 2e-3))
    # The lamp's zero is 10° now and its sign +1; the turn's sign is −1.
    assert found["lamp"]["zero"] == pytest.approx(10.0 - found["lamp"]["error"])
    assert found["turn"]["zero"] == pytest.approx(found["turn"]["error"])


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--step", "5"], "the step below the reach"),
        (["--lamp", "179"], "give angles within the lamp's limits"),
    ],
)
def test_mistakes(tmp_path, capsys, words, message):
    with emulation(tmp_path) as (rig_path, _, _):
        assert main(["align", "--rig", str(rig_path), *words]) == 2
    captured = capsys.readouterr().err
    assert message in captured
    assert captured.count("\n") == 1


def line_spectrum(wavelength, shift, random):
    """Lines 1.5 nm wide at wavelengths that the spectrometer shows `shift` too low."""
    true = wavelength + shift(wavelength)
    spectrum = np.full(len(wavelength), 50.0)
    for line in (*LINES["Hg"], *LINES["Ar"]):
        spectrum += 8000.0 * np.exp(-0.5 * ((true - line) / 0.64) ** 2)
    variance = spectrum / 2.0 + 9.0
    return spectrum + np.sqrt(variance) * random.standard_normal(len(wavelength)), variance


@pytest.mark.parametrize(("offset", "slope"), [(0.0, 0.0), (0.8, 0.0), (-1.2, 2e-3)])
def test_wavelengths_from_lines(offset, slope):
    wavelength = 340.0 + 0.47 * np.arange(1024)
    shift = lambda x: offset + slope * (x - 550.0)  # noqa: E731
    spectrum, variance = line_spectrum(wavelength, shift, np.random.default_rng(3))
    found = find_correction(wavelength, spectrum, variance, ["Hg", "Ar"])
    assert len(found.lines) == 6
    assert found.offset == pytest.approx(offset, abs=5 * found.offset_sigma)
    assert found.slope == pytest.approx(slope, abs=5 * found.slope_sigma)
    assert found.offset_sigma < 0.03
    moved = corrected(wavelength, (found.offset, found.slope))
    assert moved == pytest.approx(wavelength + shift(wavelength), abs=0.06)
    assert np.array_equal(corrected(wavelength, ()), wavelength)


def test_lines_that_are_not_there():
    wavelength = 340.0 + 0.47 * np.arange(1024)
    flat = np.full(1024, 100.0)
    with pytest.raises(UnmendedError, match="none of the lines of Hg stands out"):
        find_correction(wavelength, flat, flat, ["Hg"])
    with pytest.raises(UnmendedError, match="no lines of Xx are known here"):
        find_correction(wavelength, flat, flat, ["Xx"])
