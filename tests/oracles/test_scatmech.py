"""NIST's SCATMECH (extra 'oracles'): facets without shadowing, Rayleigh-Rice scatter, a finite aperture.

SCATMECH counts the azimuth from the mirror direction, phis = 180° − φ; angles are in radians, lengths in µm.
"""

from __future__ import annotations

from importlib import metadata

import numpy as np
import pytest

from clbrdf import Directions, Scan, fit
from clbrdf.instrument.place import observation_of
from clbrdf.instrument.rules import LADDER, Rule
from clbrdf.instrument.settings import Instrument
from clbrdf.models import get_model
from clbrdf.observation import ForwardModel
from tests.oracles.agreement import hard_directions, ordinary_directions, worst
from tests.reference.models import beckmann
from tests.reference.models.domain import ROWS, parameter_points
from tests.reference.models.geometry import geometry

INSTALLED = any(metadata.distributions(name="pySCATMECH"))
pytestmark = [
    pytest.mark.soak,
    pytest.mark.skipif(not INSTALLED, reason="pySCATMECH is not installed (extra 'oracles')"),
]
if INSTALLED:
    from pySCATMECH import brdf

# SCATMECH's polarisation bases are 0/0 there in doubles: its value is off by up to a half.
BASELESS = "mirror near the normal"


def text(value):
    """SCATMECH reads settings as text; repr keeps all digits."""
    if isinstance(value, dict):
        return {key: text(inner) for key, inner in value.items()}
    if isinstance(value, complex):
        return f"({value.real!r},{value.imag!r})"
    return repr(value) if isinstance(value, float) else value


def scatmech(kind, settings, p, directions, wavelength):
    surface = {"lambda": wavelength / 1000, "substrate": complex(p["n"], p["k"]), "type": "0"}
    model = brdf.BRDF_Model(kind, text(surface | settings))
    theta_i, theta_r, phi = directions
    angles = zip(*np.deg2rad([theta_i, theta_r, 180.0 - phi]), strict=True)
    return np.array([model.BRDF(i, r, phis) for i, r, phis in angles])


def shadowing(alpha, directions):
    """1 + Λi + Λr of Smith and Beckmann, which SCATMECH leaves out here: D F / (4 cosθi cosθr)."""
    factors = []
    for theta_i, theta_r, phi in zip(*directions, strict=True):
        g = geometry((float(theta_i), 0.0, float(theta_r), float(phi)))
        factors.append(1 + sum(beckmann.smith(v, alpha, alpha) for v in (g.incident, g.reflected)))
    return np.array(factors, dtype=float)


@pytest.mark.parametrize(
    ("directions", "tolerance"),
    [
        # The exponent, up to 1e3 for the smallest α, carries the rounding of SCATMECH's half vector.
        pytest.param(ordinary_directions(60, 1), 1e-12, id="ordinary"),
        # At 89.9° rounding the angle to radians weighs 1/cos², 3e5 times as much.
        pytest.param(hard_directions(without=BASELESS), 2e-11, id="hard"),
    ],
)
def test_facets(subject, has_model, directions, tolerance):
    has_model("beckmann_conductor")
    for p in parameter_points(ROWS["beckmann_conductor"], 12, 2):
        p["alpha"] = max(p["alpha"], 0.02)  # a smaller one leaves doubles no digits in the exponent
        slopes = {None: "Gaussian_Slope_Distribution_Function", "s": p["alpha"]}
        settings = {"sdf": slopes, "stack": "No_StackModel"}
        oracle = p["scale"] * scatmech("Facet_BRDF_Model", settings, p, directions, 633.0)
        values = subject.values("beckmann_conductor", p, directions, None) * shadowing(p["alpha"], directions)
        assert worst(values, oracle) <= tolerance + subject.bound


@pytest.mark.parametrize(
    ("directions", "tolerance"),
    [
        pytest.param(ordinary_directions(60, 3), 1e-14, id="ordinary"),
        # cosθ of 89.9° is good to 1e-13: 1e-16 of the angle over its distance from 90°.
        pytest.param(hard_directions(), 5e-13, id="hard"),
    ],
)
@pytest.mark.parametrize("wavelength", [400.0, 1064.0])
def test_microroughness(subject, has_model, directions, tolerance, wavelength):
    has_model("rayleigh_rice")
    for p in parameter_points(ROWS["rayleigh_rice"], 12, 4):
        psd = {None: "ABC_PSD_Function", "A": p["A"], "B": p["B"], "C": p["C"]}
        oracle = scatmech("Microroughness_BRDF_Model", {"psd": psd}, p, directions, wavelength)
        values = subject.values("rayleigh_rice", p, directions, wavelength)
        assert worst(values, oracle) <= tolerance + subject.bound


APERTURE = {"A": 0.001, "B": 4.0, "C": 2.5, "n": 1.5, "k": 0.0}
HALF_ANGLE = 3.0


def behind_aperture(half_angle, p, directions, wavelength):
    """Values seen by a detector of a half-angle in degrees; SCATMECH's highest order."""
    surface = {"lambda": wavelength / 1000, "substrate": complex(p["n"], p["k"]), "type": "0"}
    psd = {None: "ABC_PSD_Function", "A": p["A"], "B": p["B"], "C": p["C"]}
    inner = {None: "Microroughness_BRDF_Model", **surface, "psd": psd}
    settings = text(surface | {"model": inner, "alpha": half_angle}) | {"integralmode": "7"}
    model = brdf.BRDF_Model("Finite_Aperture_Instrument_BRDF_Model", settings)
    theta_i, theta_r, phi = np.broadcast_arrays(*directions)
    angles = zip(*np.deg2rad([theta_i, theta_r, 180.0 - phi]), strict=True)
    return np.array([model.BRDF(i, r, phis) for i, r, phis in angles])


def aperture_directions():
    theta_r = np.concatenate([np.arange(2.0, 72.0, 4.0)] * 2)
    return np.repeat([30.0, 55.0], len(theta_r) // 2), theta_r, np.full(len(theta_r), 180.0)


def test_what_an_aperture_sees():
    directions = aperture_directions()
    theirs = behind_aperture(HALF_ANGLE, APERTURE, directions, 633.0)
    model = get_model("rayleigh_rice")
    p = model.vector(APERTURE | {"wavelength": 633.0})[None, :]
    d = Directions.relative(*directions)
    change = theirs / model.brdf(p, model.features(d)) - 1.0
    assert np.abs(change).max() > 0.05
    levels = np.tile(np.array([0, LADDER.index(Rule("peak", 16))], np.uint8), (len(d), 1))
    nodes = observation_of(Instrument(), np.full(len(d), 2.0 * HALF_ANGLE), d, levels)
    ours = ForwardModel.of(model, nodes).brdf(p)
    # Its nodes lie on a disc, ours on a cone: that differs by R² of what the aperture changes.
    scale = np.deg2rad(HALF_ANGLE) ** 2 * np.abs(change).max()
    assert np.abs(ours / theirs - 1.0).max() < scale


def test_a_fit_through_an_aperture_of_theirs(device):
    directions = aperture_directions()
    values = behind_aperture(HALF_ANGLE, APERTURE, directions, 633.0)[:, None]
    scan = Scan(directions[0], 0.0, directions[1], directions[2], [633.0], values, sigma=0.002 * values)
    told = {"model": "rayleigh_rice", "weights": "sigma", "fix": {"n": 1.5, "k": 0.0}}
    through = fit(scan, through=Instrument(aperture={"angle": 2.0 * HALF_ANGLE}), **told)
    points = fit(scan, through="point", **told)
    for name in ("A", "B", "C"):
        # A tenth of σ, which is 0.2 % of noise's own.
        assert abs(through.parameters[name][0] - APERTURE[name]) < 0.1 * through.sigma[name][0]
        assert abs(points.parameters[name][0] - APERTURE[name]) > 3.0 * points.sigma[name][0]
