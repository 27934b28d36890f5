"""Every model in the browser: what the page computes against clbrdf.evaluate, all over the hemisphere."""

from __future__ import annotations

import numpy as np
import pytest

import clbrdf
from clbrdf import Directions
from clbrdf.models import NEEDS_PHI, SIGNED, get_model, model_names
from clbrdf.models.javascript import javascript_text
from clbrdf.viz.page.join import source

SUMS = ("ggx+minnaert", "abg+abg+lambert", "wang2013+eon", "wang2013-fresnel")
MODELS = (*model_names(), *SUMS)

POINTS = 2000

BOUND = 1e-12
"""Relative: the operations are the same, the functions of the language differ by units in the last place, and
an exponent of 100 turns one of them into 1e-14."""

SIGNIFICANT = 1e-30
"""Below this, 1/sr, rounding of an exponent near the end of the range is all there is."""

ASK = """
const functions = %s;
const [angles, parameters] = arguments;
const surface = makeSurface(functions, {features: %d});
const values = angles.map((a, k) => surface.of(parameters[k %% parameters.length])(...a));
const d = new Float64Array(parameters[0].length), x = new Float64Array(surface.count);
const slopes = angles.slice(0, 200).map((a, k) => {
  functions.features(anglesOf(...a, {}), x, 0);
  functions.slopes(parameters[k %% parameters.length])(x, 0, d);
  return Array.from(d);
});
// The way of the maps: features of all directions first, then values of one parameter set.
const kept = surface.features(angles.length, (k) => angles[k]);
const map = surface.value(parameters[0]);
const pixels = angles.map((a, k) => map(kept, k * surface.count));
return [values, slopes, pixels];
"""


def drawn(model, seed=4):
    """Directions (N, 4) as θi, φi, θr, φ, hard ones first, and parameter sets (K, P) within the bounds."""
    rng = np.random.default_rng(seed)
    angles = np.column_stack(
        [
            rng.uniform(0.0, 89.0, POINTS),
            rng.uniform(0.0, 360.0, POINTS) if model.flags & NEEDS_PHI else np.zeros(POINTS),
            rng.uniform(0.0, 89.9, POINTS),
            rng.uniform(0.0, 360.0, POINTS),
        ]
    )
    # The mirror direction, next to it, the retro direction, the normal, grazing, both in plane and beside.
    near = [0.0, 1e-9, 1e-6, 1e-3, 0.1]
    hard = [(45.0, 30.0, 45.0 + d, 180.0) for d in near] + [(45.0, 30.0, 45.0, 180.0 + d) for d in near]
    hard += [
        (45.0, 30.0, 45.0, 0.0),
        (0.0, 0.0, 0.0, 0.0),
        (0.0, 0.0, 60.0, 90.0),
        (89.0, 200.0, 89.9, 180.0),
    ]
    hard += [(30.0, 350.0, 30.0, 359.999), (30.0, 350.0, 0.0, 123.0)]
    angles[: len(hard)] = hard
    if not model.flags & NEEDS_PHI:
        angles[:, 1] = 0.0
    columns = []
    for p in model.parameters:
        low, high = p.bounds
        if p.given == "wavelength":
            columns.append(np.full(7, 550.0))
        elif p.scale == "log":
            ends = np.abs([low, high])
            floor = max(ends.min(), p.log_floor, ends.max() * 1e-6)
            columns.append(p.sign * np.exp(rng.uniform(np.log(floor), np.log(ends.max()), 7)))
        else:
            columns.append(rng.uniform(low, high, 7))
    sets = np.column_stack(columns)
    sets[0] = model.defaults
    for j, p in enumerate(model.parameters):
        if p.given == "wavelength":
            sets[:, j] = 550.0
    return angles, sets


def size_of(model, parameters, values):
    """What an error is relative to: the value, and for models that cancel what cancels in it."""
    if not model.flags & SIGNED:
        return np.abs(values)
    return np.maximum(np.abs(values), np.abs(parameters[list(model.linear)]).sum() / np.pi)


@pytest.fixture(scope="module")
def blank(browser):
    """A browser with an empty page."""
    browser.get("about:blank")
    return browser


@pytest.fixture(scope="module", params=MODELS)
def answers(request, blank):
    """Name, directions, parameter of each, and values and slopes as the browser computes them."""
    model = get_model(request.param)
    angles, sets = drawn(model)
    helpers = "\n".join(source(name) for name in ("special.js", "angles.js", "surface.js"))
    ask = helpers + ASK % (javascript_text(model.formula), len(model.formula.features))
    values, slopes, pixels = blank.execute_script(ask, angles.tolist(), sets.tolist())
    # Maps show what readouts say: to the last digit, for all pixels of the set that both have computed.
    assert pixels[:: len(sets)] == values[:: len(sets)]
    to_number = [np.nan if v is None else v for v in values]
    return model, angles, sets, np.array(to_number, float), np.array(slopes, float)


def test_readouts_against_the_reference(answers):
    model, angles, sets, values, _ = answers
    worst = 0.0
    for k, parameters in enumerate(sets):
        rows = slice(k, None, len(sets))
        a = angles[rows]
        directions = Directions(a[:, 0], a[:, 1], a[:, 2], a[:, 3] + a[:, 1])
        expected = model.brdf(parameters[None], model.features(directions))
        good = np.isfinite(expected) & (np.abs(expected) > SIGNIFICANT)
        assert good.any()
        error = np.abs(values[rows] - expected)[good] / size_of(model, parameters, expected)[good]
        worst = max(worst, float(error.max()))
        assert (np.isfinite(values[rows]) == np.isfinite(expected)).all()
    assert worst <= BOUND


def test_readouts_against_the_command(answers, device):
    """The values that `clbrdf evaluate` prints, from the OpenCL kernel in double precision."""
    model, angles, sets, values, _ = answers
    if model.flags & NEEDS_PHI:
        pytest.skip("the command has no incident azimuth")
    if not device.has_double:
        pytest.skip("the device has no double precision")
    rows = slice(0, None, len(sets))
    a = angles[rows]
    given = dict(zip(model.names, sets[0], strict=True))
    expected = clbrdf.evaluate(
        given, a[:, 0], a[:, 2], a[:, 3], model=model.name, precision="double", device=device
    )
    good = np.abs(expected) > SIGNIFICANT
    assert (np.abs(values[rows] - expected)[good] / size_of(model, sets[0], expected)[good]).max() <= BOUND


def test_slopes(answers):
    model, angles, sets, _, slopes = answers
    a = angles[: len(slopes)]
    x = model.features(Directions(a[:, 0], a[:, 1], a[:, 2], a[:, 3] + a[:, 1]))
    for k, found in enumerate(slopes):
        expected = model.jacobian(sets[k % len(sets)][None], x[k : k + 1])[0]
        good = np.isfinite(expected)
        assert np.abs(found - expected)[good].max(initial=0.0) <= 1e-9 * np.abs(expected[good]).max(
            initial=1e-300
        )


def test_the_functions_print_no_name_that_the_page_lacks(answers):
    model = answers[0]
    text = javascript_text(model.formula)
    for word in ("nan", "inf", "np.", "realv"):
        assert word not in text
