"""Eradiate's fork of Mitsuba (extra 'oracles'): rpv, rtls and hapke.

`eradiate-mitsuba` installs the module `mitsuba`, as the package `mitsuba` itself does: they cannot stand in
one folder. `eval` gives f cosθr for directions away from the surface.
"""

from __future__ import annotations

from importlib import metadata

import numpy as np
import pytest

from tests.oracles.agreement import hard_directions, ordinary_directions, worst
from tests.reference.models.domain import ROWS, parameter_points

INSTALLED = any(metadata.distributions(name="eradiate-mitsuba"))
pytestmark = [
    pytest.mark.soak,
    pytest.mark.skipif(not INSTALLED, reason="eradiate-mitsuba is not installed (extra 'oracles')"),
]
if INSTALLED:
    import mitsuba

    mitsuba.set_variant("scalar_mono_double")

# By plugin: the model's name here, and parameters by their name there.
PLUGINS = {
    "rpv": ("rpv", {"rho_0": "rho0", "k": "k", "g": "Theta", "rho_c": "rho_c"}),
    "rtls": ("ross_li", {"f_iso": "f_iso", "f_vol": "f_vol", "f_geo": "f_geo"}),
    "hapke": ("hapke", {"w": "w", "b": "b", "c": "c", "theta": "theta_bar", "h": "h", "B_0": "B0"}),
}


def vector(theta, phi):
    theta, phi = np.deg2rad([theta, phi])
    return [float(np.sin(theta) * np.cos(phi)), float(np.sin(theta) * np.sin(phi)), float(np.cos(theta))]


def eradiate(plugin, p, directions):
    settings = {theirs: p[ours] for theirs, ours in PLUGINS[plugin][1].items()}
    bsdf = mitsuba.load_dict({"type": plugin, **settings})
    context, interaction = mitsuba.BSDFContext(), mitsuba.SurfaceInteraction3f()
    values = []
    for theta_i, theta_r, phi in zip(*directions, strict=True):
        interaction.wi = vector(theta_i, 0.0)
        outgoing = bsdf.eval(context, interaction, vector(theta_r, phi))
        values.append(outgoing[0] / np.cos(np.deg2rad(theta_r)))
    return np.array(values)


@pytest.mark.parametrize(
    ("directions", "tolerance"),
    [
        # The phase angle by acos is good to 1e-16 over its sine, 3e-15 at 2°; what follows adds some.
        pytest.param(ordinary_directions(60, 5), 5e-14, id="ordinary"),
        # At 89.9° the tangents of the models weigh the rounding of cosθ, 1e-13, up to 1/cosθ, 573 times.
        pytest.param(hard_directions(hot_spot=False), 2e-10, id="hard"),
        # In the hot spot acos loses half of the digits, and tanθ at 89.9° multiplies what is left.
        pytest.param(hard_directions(hot_spot=True), 5e-5, id="hot spot"),
    ],
)
@pytest.mark.parametrize("plugin", PLUGINS)
def test_plugin(subject, has_model, plugin, directions, tolerance):
    name, _ = PLUGINS[plugin]
    has_model(name)
    for p in parameter_points(ROWS[name], 12, 6):
        # The terms of Ross and Li cancel; what counts is the largest of them.
        scale = sum(map(abs, p.values())) / np.pi if name == "ross_li" else 1e-250
        values = subject.values(name, p, directions, None)
        assert worst(values, eradiate(plugin, p, directions), scale) <= tolerance + subject.bound
