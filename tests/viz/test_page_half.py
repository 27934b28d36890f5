"""Half and difference angles of the page's scripts, against vectors in NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from clbrdf.viz.page.join import source

SCRIPTS = "\n".join(source(name) for name in ("angles.js", "half.js", "sphere.js"))


def unit(theta, phi):
    t, p = np.deg2rad(theta), np.deg2rad(phi)
    return np.array([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)])


@pytest.fixture(scope="module")
def ask(browser):
    browser.get("about:blank")
    return lambda call, *arguments: browser.execute_script(f"{SCRIPTS}\nreturn {call};", *arguments)


def test_half_angles_of_directions(ask):
    rng = np.random.default_rng(0)
    angles = np.column_stack([rng.uniform(0.1, 85.0, (300, 2)), rng.uniform(0.0, 360.0, 300)])
    angles[:3] = [(45.0, 45.0, 180.0 + 1e-7), (30.0, 30.0, 0.0), (60.0, 20.0, 180.0)]
    found = ask("arguments[0].map((a) => halfOfDirections(...a))", angles.tolist())
    for (theta_i, theta_r, phi), here in zip(angles, found, strict=True):
        i, r = unit(theta_i, 0.0), unit(theta_r, phi)
        h = (i + r) / np.linalg.norm(i + r)
        assert np.cos(np.deg2rad(here["thetaH"])) == pytest.approx(h[2], abs=1e-12)
        assert np.cos(np.deg2rad(here["thetaD"])) == pytest.approx(i @ h, abs=1e-12)


def test_there_and_back(ask):
    """From (θh, θd, φd) to directions and back; where a direction is below the horizon there is none."""
    rng = np.random.default_rng(1)
    given = np.column_stack([rng.uniform(1.0, 89.0, (400, 2)), rng.uniform(1.0, 179.0, 400)])
    call = """arguments[0].map((a) => { const at = directionsOfHalf(...a);
        return at && [at.thetaI, at.thetaR, at.phi, halfOfDirections(at.thetaI, at.thetaR, at.phi)]; })"""
    found = ask(call, given.tolist())
    there = 0
    for (theta_h, theta_d, phi_d), back in zip(given, found, strict=True):
        h, d = np.deg2rad(theta_h), unit(theta_d, phi_d)
        z = [-x * np.sin(h) + d[2] * np.cos(h) for x in (d[0], -d[0])]
        assert (back is None) == (min(z) <= 0.001)
        if back is None:
            continue
        there += 1
        *_, angles = back
        assert angles["thetaH"] == pytest.approx(theta_h, abs=1e-9)
        assert angles["thetaD"] == pytest.approx(theta_d, abs=1e-9)
        assert angles["phiD"] == pytest.approx(phi_d, abs=1e-7)
    assert 100 < there < 400


def test_angles_on_the_sphere(ask):
    rng = np.random.default_rng(2)
    n = rng.standard_normal((200, 3))
    n /= np.linalg.norm(n, axis=1)[:, None]
    light = unit(50.0, 20.0)
    call = "((all, l) => all.map((n) => anglesOnSphere(n, l)))(arguments[0], arguments[1])"
    found = ask(call, n.tolist(), light.tolist())
    lit = 0
    for normal, at in zip(n, found, strict=True):
        if at is None:
            assert min(normal @ light, normal[2]) < np.cos(np.deg2rad(88.4))
            continue
        lit += 1
        assert np.cos(np.deg2rad(at["thetaI"])) == pytest.approx(normal @ light, abs=1e-12)
        assert np.cos(np.deg2rad(at["thetaR"])) == pytest.approx(normal[2], abs=1e-12)
        # The angle between light and viewer follows from both zeniths and φ.
        between = unit(at["thetaI"], 0.0) @ unit(at["thetaR"], at["phi"])
        assert between == pytest.approx(light[2], abs=1e-10)
    assert lit > 30
