"""A scene pays for what it asks for and for nothing else."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import textwrap

import numpy as np
import pytest

import clbrdf
from clbrdf.opencl import program, values
from clbrdf.scene import scenefile, simulate
from clbrdf.scene.scenefile import EFFECTS
from clbrdf.scene.simulate import set_up, values_of
from clbrdf.scene.steps import BACK, COUNTS, ON_COUNTS, STEPS, steps
from tests.scene.scenes import scene

CURVES = {"c": {"polynomial": [-300, 20], "centre": 550, "scale": 100}, "kd": [[400, 1.0], [700, 1.4]]}
LARGE = {
    "theta_i": [30, 45, 60],
    "theta_r": {"start": 0, "stop": 85, "step": 1},
    "phi_r": {"start": 0, "stop": 350, "step": 10},
    "wavelength": {"start": 400, "stop": 700, "step": 2},
}


def evaluated(made):
    """The same values by `clbrdf.evaluate`."""
    ready = set_up(made)
    t = (ready.wavelength - 550.0) / 100.0
    parameters = {"c": -300 + 20 * t, "kd": np.interp(ready.wavelength, [400, 700], [1.0, 1.4])}
    d = ready.nominal
    return lambda: clbrdf.evaluate(parameters, d.theta_i, d.theta_r, d.phi, precision=made.precision)


@pytest.fixture
def sources(monkeypatch):
    """The sources of all programs that are built or used from here on."""
    seen = []
    build = program.build

    def spy(device, variant):
        seen.append(program.source_text(variant))
        return build(device, variant)

    monkeypatch.setattr(values, "build", spy)
    return seen


@pytest.mark.parametrize("precision", ["fast", "single", "double"])
def test_without_effects_it_is_evaluate_bit_for_bit(precision, sources):
    made = scene(**LARGE, surface={"parameters": CURVES}, precision=precision)
    ours = values_of(set_up(made))
    own = set(sources)
    sources.clear()
    theirs = evaluated(made)()
    assert own == set(sources)
    np.testing.assert_array_equal(ours, theirs)
    np.testing.assert_array_equal(simulate(made, block_values=100_000).brdf, theirs)


FOLDERS = ("clbrdf.scene.effects.", "clbrdf.instrument.")
"""Of the effects that only scenes know, and of those that fits know too."""

NODES, BANDS = "k < nodes", "b < bands"


@pytest.mark.parametrize("name", EFFECTS)
def test_one_effect_brings_no_code_of_the_others(name, sources):
    simulate(scene(wavelength=[500, 600], surface={"parameters": CURVES}, effects={name: True}))
    assert sources
    for text in sources:
        assert (NODES in text) == (name in ("aperture", "beam"))
        assert (BANDS in text) == (name == "bandwidth")
        assert ("kernel void mean" in text) == (name in ("aperture", "beam", "bandwidth"))


@pytest.mark.parametrize("name", [None, *EFFECTS])
def test_only_the_steps_asked_for_are_taken(name):
    path = [step for step, _ in steps(scene(effects={name: True} if name else {}))]
    assert [step for step in path if step in STEPS] == ([name] if name in STEPS else [])
    assert (path[:1] == [COUNTS] and path[-1:] == [BACK]) == (name in ON_COUNTS)


@pytest.mark.parametrize("name", [None, *EFFECTS])
def test_no_function_of_another_effect_is_called(name, monkeypatch):
    called = set()

    def profile(frame, event, argument):
        module = frame.f_globals.get("__name__", "")
        if event == "call" and module.startswith(FOLDERS) and module.rpartition(".")[2] in EFFECTS:
            called.add(module.rpartition(".")[2])

    made = scene(effects={name: True} if name else {})
    sys.setprofile(profile)
    try:
        simulate(made)
    finally:
        sys.setprofile(None)
    shared = {"dark": {"lamp_drift"}}  # a straight line in time
    without_function = {"reader"}
    expected = {name} - {None} - without_function
    assert expected <= called <= expected | shared.get(name, set())


def test_every_effect_has_its_file():
    fields = scenefile.Effects.model_fields
    for name in EFFECTS:
        folder = next(f for f in FOLDERS if importlib.util.find_spec(f + name))
        module = importlib.import_module(folder + name)
        assert any(vars(module).get(kind.__name__) is kind for kind in fields[name].annotation.__args__)
        assert "Source" in module.__doc__ or "source" in module.__doc__


def test_reading_a_scene_loads_no_opencl_and_no_scipy():
    code = """
    import sys
    from clbrdf.scene import load_scene
    heavy = [name for name in ("pyopencl", "scipy", "h5py", "vtk", "nlopt") if name in sys.modules]
    assert not heavy, heavy
    """
    subprocess.run([sys.executable, "-c", textwrap.dedent(code)], check=True)
