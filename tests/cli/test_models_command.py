"""`clbrdf models`: the list, and a page."""

from __future__ import annotations

import json

import pytest

from clbrdf.models import get_model, model_names

PHONG = """
from clbrdf.models import linear, log_shape, model

MODEL = model(
    title="Phong's lobe about the mirror direction",
    source="Phong 1975",
    parameters=[
        linear("ks", "1", 0.5, (0.0, 5.0), "weight of the lobe"),
        log_shape("n", "1", 20.0, (1.0, 1000.0), "exponent"),
    ],
    value=lambda g, ks, n: ks / g.pi,
)
"""


def test_the_list_has_every_model(run):
    status, out, err = run("models")
    assert (status, err) == (0, "")
    assert max(len(line) for line in out.splitlines()) <= 100
    first = {line.split()[0] for line in out.splitlines() if line.strip()}
    assert set(model_names()) <= first


@pytest.mark.parametrize("name", [*model_names(), "ggx+ggx+minnaert", "wang2013-fresnel"])
def test_a_page_has_table_limits_and_source(run, name):
    status, out, err = run("models", name)
    assert (status, err) == (0, "")
    assert max(len(line) for line in out.splitlines()) <= 100
    model = get_model(name)
    joined = " ".join(out.split())
    assert model.source.split(",")[0] in joined
    for row in model.parameters:
        assert row.name in out
        if not row.given:
            assert f"{row.bounds[0]:.4g} to {row.bounds[1]:.4g}" in joined


def test_promises_and_needs_are_words(run):
    assert "source and detector may change places" in run("models", "ggx")[1]
    assert "can be negative" in run("models", "ross_li")[1]
    assert "to be fixed" in run("models", "rayleigh_rice")[1]
    assert "in a sum it brings its lobe only" in run("models", "wang2013")[1]


def test_a_page_of_ones_own_is_shown(run, tmp_path):
    (tmp_path / "phong.py").write_text(PHONG)
    status, out, _ = run("models", tmp_path / "phong.py")
    assert status == 0
    assert "Phong's lobe about the mirror direction" in out
    assert "1 to 1000" in out


def test_json_has_the_same(run, tmp_path):
    run("models", "ggx", "--json", tmp_path / "ggx.json")
    (told,) = json.loads((tmp_path / "ggx.json").read_text())["models"]
    assert told["flags"] == ["reciprocal", "bounded"]
    assert told["parameters"][0]["bounds"] == [0.002, 1.5]


@pytest.mark.parametrize(
    ("name", "message"),
    [("nonesuch", "no model is called 'nonesuch'; there are abg,"), ("hapke+rpv", "or --force")],
)
def test_unknown_models_end_in_one_line(run, name, message):
    status, out, err = run("models", name)
    assert (status, out) == (2, "")
    assert message in err
    assert run("models", "hapke+rpv", "--force")[0] == 0
