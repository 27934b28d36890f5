"""The mesh kernel against the reference evaluation, on every device and for every model."""

from __future__ import annotations

import numpy as np
import pytest

from clbrdf import Directions
from clbrdf.models import get_model, model_names
from clbrdf.viz.directions import angles_of
from clbrdf.viz.evaluator import mesh_evaluator
from clbrdf.viz.mesh import LobeMesh


@pytest.mark.parametrize("name", model_names())
@pytest.mark.parametrize("theta_i", [0.0, 10.0, 45.0, 84.0])
def test_values_agree_with_the_model(device, name, theta_i):
    model = get_model(name)
    evaluator = mesh_evaluator(model, LobeMesh(0.03, rings=40, sectors=24), device)
    evaluator.move(theta_i)
    vector = model.defaults
    values = evaluator.values(vector).astype(float)
    x, y, z = (v.astype(float) for v in evaluator.views[:3])
    zenith, azimuth = angles_of(np.stack([x, y, z], axis=-1).reshape(-1, 3))
    directions = Directions.relative(np.array([theta_i]), zenith, azimuth)
    expected = model.brdf(vector[None, :], model.features(directions)).reshape(values.shape)
    # Away from the mirror direction, where single precision angles decide; 1e-4 of the value, or of the
    # smallest that a picture shows.
    np.testing.assert_allclose(values, expected, rtol=2e-4, atol=1e-6 * expected.max())


def test_the_middle_of_a_needle_keeps_its_value(device, needle):
    from clbrdf.viz.subject import lobe_width

    width = lobe_width(needle, 45.0)
    np.testing.assert_allclose(np.rad2deg(width), 0.05, rtol=0.05)
    evaluator = mesh_evaluator(needle.fit.model, LobeMesh(width), device)
    evaluator.move(45.0)
    values = evaluator.values(needle.parameters(1)).astype(float)
    peak = needle.fit.evaluate(Directions.relative(np.array([45.0]), np.array([45.0]), np.array([180.0])))[
        0, 1
    ]
    np.testing.assert_allclose(values[0], peak, rtol=1e-4)
    # The mesh resolves the flanks: neighbouring rings inside the lobe differ by little.
    inside = values[:, 5] > 0.05 * peak
    assert inside.sum() >= 10
    assert np.abs(np.diff(values[inside, 5])).max() < 0.25 * peak


def test_a_new_wavelength_needs_no_new_directions(foil):
    evaluator = mesh_evaluator(foil.fit.model, LobeMesh(0.03))
    evaluator.move(45.0)
    first, views = evaluator.values(foil.parameters(0)), evaluator.views
    last = evaluator.values(foil.parameters(2))
    assert evaluator.views is views
    np.testing.assert_allclose(last / first, 1.1 / 0.9, rtol=1e-5)
