"""Every choice that is made for a GPU, forced on the CPU's runtime, gives the values of the CPU's choices.

They are one lane, work groups of the driver's size, and results that are copied and not mapped. All follow
from `Device.kind`: a record that says "gpu" gets them. No GPU is asked for.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import clbrdf
from clbrdf.fit import AnnealSettings
from clbrdf.geometry import Directions
from clbrdf.models import get_model
from clbrdf.opencl.device import choose_device
from clbrdf.opencl.lanes import Lanes, lanes_of
from clbrdf.opencl.precision import PRECISIONS
from clbrdf.opencl.program import work_group
from clbrdf.opencl.values import Launcher
from clbrdf.scans import sample_scan, sample_scene
from clbrdf.scene.scenefile import load_scene
from clbrdf.scene.simulate import simulate


@pytest.fixture(scope="module")
def cpu():
    device = choose_device()
    if device.kind != "cpu":
        pytest.skip("the preferred device is no CPU")
    return device


@pytest.fixture(scope="module")
def gpu(cpu):
    return replace(cpu, kind="gpu")


@pytest.fixture(scope="module")
def scan():
    whole = clbrdf.Scan.open(sample_scan("yellow_tin_foil"))
    return whole.columns(np.arange(0, len(whole.wavelength), 80))


def test_the_choices_are_those_of_a_gpu(cpu, gpu):
    assert lanes_of(gpu, np.float32) == lanes_of(gpu, np.float64) == Lanes(1, 1)
    assert lanes_of(cpu, np.float32).width > 1
    assert work_group(gpu, 2) is None
    assert work_group(cpu, 2) == (1, 1)
    model = get_model()
    directions = Directions([30.0], [0.0], [40.0], [180.0])
    for device, copied in ((gpu, True), (cpu, False)):
        launcher = Launcher(model, np.array([model.defaults]), PRECISIONS["double"], device)
        pending = launcher.begin(model.features(directions))
        assert (pending.mapped.base is None) == copied
        launcher.finish(pending, np.empty((1, 1)))


@pytest.mark.parametrize(("precision", "rtol"), [("double", 1e-13), ("single", 1e-5)])
@pytest.mark.parametrize("model", ["wang2013", "ggx+lambert", "oren_nayar"])
def test_values(cpu, gpu, model, precision, rtol):
    """Lanes compute side by side what one lane does: what differs is how products and sums are contracted."""
    chosen = get_model(model)
    parameters = dict(zip(chosen.names, chosen.defaults, strict=True))
    angles = (np.repeat([5.0, 45.0, 80.0], 40), np.tile(np.linspace(0.0, 88.0, 40), 3), 180.0)
    values = [
        clbrdf.evaluate(parameters, *angles, model=model, precision=precision, device=device)
        for device in (cpu, gpu)
    ]
    np.testing.assert_allclose(values[1], values[0], rtol=rtol)


def test_means_over_nodes(cpu, gpu):
    """A scene with an aperture: means over nodes, in work groups of another size."""
    scene = load_scene(sample_scene("yellow_tin_foil"))
    scene = scene.model_copy(update={"precision": "double"})
    first, second = (simulate(scene, device=device) for device in (cpu, gpu))
    np.testing.assert_allclose(second.brdf, first.brdf, rtol=1e-9)


@pytest.mark.parametrize(
    ("model", "method"),
    [
        ("wang2013", "dictionary"),
        ("ggx+lambert", "lookup"),
        ("hapke", "lookup"),
        ("wang2013", "anneal-separable"),
        ("wang2013", "tempering"),
    ],
)
def test_fits(cpu, gpu, scan, model, method):
    """Sums over directions run in another order: E at the optimum is the same to far below 1e-9."""
    settings = AnnealSettings(chains=8, levels=10) if method == "anneal-separable" else None
    first, second = (
        clbrdf.fit(scan, model=model, method=method, settings=settings, device=device)
        for device in (cpu, gpu)
    )
    np.testing.assert_allclose(second.objective, first.objective, rtol=1e-9)
    for name in first.model.names:
        apart = np.abs(second.parameters[name] - first.parameters[name])
        room = np.where(np.isfinite(first.sigma[name]), first.sigma[name], np.abs(first.parameters[name]))
        assert (apart <= 1e-3 * room + 1e-12).all(), name
    assert (second.status == first.status).all()
