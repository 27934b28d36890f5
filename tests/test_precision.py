"""Every precision on the hard cases and over the domain, against 60 digits."""

from __future__ import annotations

import numpy as np
import pytest
from mpmath import mpf

import clbrdf
from clbrdf import InputError
from clbrdf.bench.hard_cases import HARD_CASES, TIN_FOIL
from clbrdf.models import get_model
from clbrdf.observation import ForwardModel
from clbrdf.opencl.precision import PRECISIONS, get_precision
from tests.models.test_wang2013 import domain_points, pairwise
from tests.reference import exact

NAMES = get_model().names
SMALLEST = 1e-30


def relative_errors(values, references):
    return [
        float(abs(mpf(float(v)) - r) / r) for v, r in zip(values, references, strict=True) if r > SMALLEST
    ]


@pytest.fixture(scope="module")
def references():
    """Exact values of every hard case, computed once."""
    return {
        case.name: [
            [exact.brdf([p[n] for n in NAMES], *angles) for angles in zip(*case.angles(), strict=True)]
            for p in case.parameter_sets()
        ]
        for case in HARD_CASES
    }


@pytest.mark.parametrize("precision", PRECISIONS.values(), ids=lambda p: p.name)
@pytest.mark.parametrize("case", HARD_CASES, ids=lambda case: case.name)
def test_hard_cases_keep_the_stated_bound(case, precision, references, device):
    for p, exact_values in zip(case.parameter_sets(), references[case.name], strict=True):
        values = clbrdf.evaluate(p, *case.angles(), precision=precision.name, device=device)
        assert np.isfinite(values).all()
        assert (values >= 0.0).all()
        assert max(relative_errors(values, exact_values), default=0.0) <= precision.bound


@pytest.mark.parametrize("precision", PRECISIONS.values(), ids=lambda p: p.name)
def test_the_whole_domain_keeps_the_stated_bound(precision, device):
    parameters, *angles = domain_points(3000, seed=11)

    def evaluate(named, *part):
        return clbrdf.evaluate(named, *part, precision=precision.name, device=device)

    values = pairwise(evaluate, parameters, angles)
    exact_values = [exact.brdf(p, *a) for p, a in zip(parameters, zip(*angles, strict=True), strict=True)]
    errors = relative_errors(values, exact_values)
    assert np.isfinite(values).all()
    assert len(errors) > 2500
    assert max(errors) <= precision.bound


def test_bounds_are_no_larger_than_they_have_to_be(references, device):
    """A bound that nothing comes near would hide a loss of digits."""
    parameters, *angles = domain_points(3000, seed=11)
    exact_domain = [exact.brdf(p, *a) for p, a in zip(parameters, zip(*angles, strict=True), strict=True)]
    for precision in PRECISIONS.values():

        def evaluate(named, *part, name=precision.name):
            return clbrdf.evaluate(named, *part, precision=name, device=device)

        worst = max(relative_errors(pairwise(evaluate, parameters, angles), exact_domain))
        for case in HARD_CASES:
            for p, exact_values in zip(case.parameter_sets(), references[case.name], strict=True):
                values = clbrdf.evaluate(p, *case.angles(), precision=precision.name, device=device)
                worst = max(worst, *relative_errors(values, exact_values), 0.0)
        assert worst >= precision.bound / 30.0, precision


def test_the_reference_is_the_printed_equation():
    angles = ([30.0, 60.0, 89.9], [30.0, 59.0, 10.0], [180.0, 170.0, 0.0])
    ours = clbrdf.evaluate(TIN_FOIL, *angles, precision="reference")
    theirs = [float(exact.brdf([TIN_FOIL[n] for n in NAMES], *a)) for a in zip(*angles, strict=True)]
    assert ours.tolist() == theirs


def test_fast_is_fast_4_and_unknown_names_are_refused():
    assert get_precision("fast") is get_precision("fast:4")
    with pytest.raises(InputError, match=r"no precision is called 'half'; there are fast, fast:3"):
        get_precision("half")


@pytest.mark.soak
def test_sums_over_ten_million_points(device):
    """A constant deviation of 2 % of constant data: E is 4e-4 whatever the number of points."""
    from clbrdf.fit.polish import polish
    from clbrdf.fit.problem import Problem

    n = 10_000_000
    model = get_model()
    diffuse = model.to_coordinates(np.array([0.0, 0.5, -1.0, 1.0, 0.0, 1.0]))
    features = np.tile(model.features(clbrdf.Directions.relative(30.0, 20.0, 180.0)), (n, 1))
    measured = 1.0 / np.pi / 1.02
    scale = np.full((1, n), 1.0 / (measured * np.sqrt(n)))
    problem = Problem(
        model,
        features,
        ForwardModel(model, features),
        np.array([0, n], np.uint32),
        scale * measured,
        scale,
        (diffuse - 1e-9)[None],
        (diffuse + 1e-9)[None],
        tuple(range(6)),
        np.zeros(n),
        np.zeros(1, np.uint32),
        device,
        np.arange(n),
    )
    end = polish(problem, diffuse[None, None, :])
    # The limits leave kd a relative play of 1e-9; the sum itself adds N ulp at most, 1e-9 relative.
    assert end.objective[0, 0] == pytest.approx(4e-4, rel=2e-7)
