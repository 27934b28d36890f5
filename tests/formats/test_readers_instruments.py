"""Files of instruments and optical programs written by hand: Zemax, ASTM, Speos, FRED, LightTools."""

from __future__ import annotations

import math

import numpy as np
import pytest

from clbrdf.formats.load import load, load_one
from clbrdf.formats.vectors import (
    from_half_difference,
    from_specular,
    to_half_difference,
    to_specular,
)
from tests.formats import made_files as made
from tests.formats.looked_up import at
from tests.formats.made_files import F


def test_zemax_geometry_against_vectors_worked_by_hand(text):
    # θi = 40°, r = 10°: towards the normal (a = 0) the zenith is 30°, away from it (180) 50°, both forward.
    # Across (a = 90): z = cos 10 cos 40 = 0.754407, θr = 41.0288°; x = −cos 10 sin 40, y = sin 10:
    # the azimuth is 180 − atan(0.173648 / 0.633022) = 164.6597°.
    scan = load_one([text(made.zemax(values=lambda i, a, r: 1.0 + i + (a / 1000.0 if r else 0.0) + r / 1e6))])
    assert scan.wavelength.tolist() == [633.0]
    assert scan.sample == "made"
    for theta_r, phi, a in ((30.0, 180.0, 0.0), (50.0, 180.0, 180.0), (41.0288, 164.6597, 90.0)):
        assert at(scan, 40.0, theta_r, phi) == pytest.approx([41.0 + a / 1000.0 + 10 / 1e6])
    assert at(scan, 40.0, 40.0, 180.0) == pytest.approx([41.0])
    # r = 60 towards the normal passes it: θr = 20° on the side of the source.
    assert at(scan, 40.0, 20.0, 0.0) == pytest.approx([41.0 + 60 / 1e6])
    # r = 60 away from the normal lies at 100°, below the horizon.
    assert len(scan) == 2 * (1 + 3 * 3) - 1


def test_specular_and_half_angles_have_inverses():
    rng = np.random.default_rng(4)
    i, r = rng.uniform(0.5, 89.5, (2, 500))
    p = rng.uniform(0.0, 360.0, 500)
    back = from_specular(i, *to_specular(i, r, p))
    np.testing.assert_allclose(back[0], r, atol=1e-9)
    np.testing.assert_allclose(np.cos(np.deg2rad(back[1] - p)), 1.0, atol=1e-12)
    half = to_half_difference(i, r, p)
    again = from_half_difference(*half)
    # φd is kept within half a turn: the other half is the exchange of source and view.
    same = np.abs(again[0] - i) < 1e-7
    exchanged = (np.abs(again[0] - r) < 1e-7) & (np.abs(again[1] - i) < 1e-7)
    assert (same | exchanged).all()


def test_astm_in_radians_and_both_dialects(text):
    scan = load_one([text(made.astm())])
    assert np.unique(scan.theta_i) == pytest.approx(np.rad2deg([0.3, 0.9]))
    assert np.unique(scan.phi) == pytest.approx([0.0, 90.0, 180.0])
    assert scan.sample == "paint"
    quirk = text(made.astm("theta_i,phi_i,theta_s,R,G"), "quirk.txt")
    told = load([quirk])
    assert next(iter(told.scans.values())).bands == ("R", "G")
    assert "VARS leaves out phi_s" in next(iter(told.notes.values()))[0]


def test_speos_percent_sets_the_scale(text):
    for intensity in (False, True):
        scan = load_one([text(made.speos(intensity))])
        assert scan.wavelength.tolist() == [450.0, 550.0]
        # Between rings 30° apart the cosine of an intensity is no straight line: 2.4 % in all.
        near = 0.03 if intensity else 1e-9
        # A Lambertian that scatters 40 % has f = 0.4/π, whatever the table's own scale.
        assert at(scan, 0.0, 30.0, 0.0, 0) == pytest.approx([0.4 / math.pi], rel=near)
        assert at(scan, 45.0, 60.0, 90.0, 1) == pytest.approx([0.1 / math.pi], rel=near)
        assert at(scan, 45.0, 120.0, 90.0, 0) == pytest.approx([0.3 / math.pi], rel=near)
        assert set(scan.side) == {"reflection", "transmission"}


def test_speos_forward_is_azimuth_0(text):
    lines = made.speos().split("\n")
    row = lines.index("60 " + " ".join(["7.0"] * 5))
    lines[row] = "60 14.0 7.0 7.0 7.0 14.0"
    scan = load_one([text("\n".join(lines))])
    bright = scan.brdf[:, 0] > 1.5 * scan.brdf[0, 0]
    assert scan.phi[bright].tolist() == [180.0]


def test_anisotropic_speos_has_rotations(text):
    scan = load_one([text(made.anisotropic())])
    assert scan.rotations().tolist() == [0.0, 90.0]
    # The spectrum belongs to rotation 0; the other one is twice as bright.
    by_rotation = [np.unique(np.round(scan.brdf[scan.phi_i == angle], 9)) for angle in (0.0, 90.0)]
    assert by_rotation[0] == pytest.approx([0.4 / math.pi])
    assert by_rotation[1] == pytest.approx([0.8 / math.pi])


@pytest.mark.parametrize(("angles", "bsdf"), [("deg", "value"), ("sin", "value"), ("deg", "log")])
def test_fred_settings(text, angles, bsdf):
    scan = load_one([text(made.fred(angles, bsdf))])
    assert at(scan, 20.0, 20.0, 180.0) == pytest.approx([3.0 * F])
    assert at(scan, 50.0, 70.0, 0.0) == pytest.approx([F])
    assert scan.bands == ("monochrome",)


def test_lighttools_turns_by_90_degrees_and_has_three_parts(text):
    loaded = load([text(made.lighttools())])
    front, back = loaded.scans.values()
    assert at(front, 40.0, 40.0, 180.0) == pytest.approx([2 * F])
    assert at(front, 20.0, 140.0, 180.0) == pytest.approx([2 * F])
    assert at(front, 20.0, 80.0, 0.0) == pytest.approx([F])
    assert set(back.side) == {"reflection"}
