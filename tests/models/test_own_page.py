"""A model of one's own: one page outside the package, which everything then takes."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest

import clbrdf
from clbrdf import Directions, Fit, InputError, Scan
from clbrdf.models import get_model, model_names
from clbrdf.optimizers.check import check_fit

PAGE = '''"""Phong's lobe on a Lambert base."""

from clbrdf.models import RECIPROCAL, linear, log_shape, model
from clbrdf.models.expression import exp, greatest, log


def value(g, ks, n, kd):
    """Record the value; the cosine between mirror and view direction is that of 2 gamma."""
    cosine = 2.0 * (1.0 - g.one_minus_cos_gamma) ** 2 - 1.0
    return ks * exp(n * log(greatest(cosine, 1e-9))) + kd / g.pi


MODEL = model(
    title="Phong's lobe on a Lambert base",
    source="Phong, Commun. ACM 18 (1975) 311, doi:10.1145/360825.360839",
    parameters=[
        linear("ks", "1", 0.2, (0.0, 10.0), "weight of the lobe"),
        log_shape("n", "1", 20.0, (1.0, 1e4), "exponent of the lobe"),
        linear("kd", "1", 0.3, (0.0, 1.2), "weight of the base"),
    ],
    value=value,
    kind="whole",
    flags=RECIPROCAL,
)
'''


def phong(ks, n, kd, theta_i, theta_r, phi):
    """The same in plain NumPy: the cosine between mirror and view direction to the power n."""
    i, r, p = (np.deg2rad(a) for a in (theta_i, theta_r, phi))
    cosine = np.cos(i) * np.cos(r) - np.sin(i) * np.sin(r) * np.cos(p)
    return ks * np.maximum(cosine, 0.0) ** n + kd / np.pi


@pytest.fixture
def page(tmp_path, monkeypatch):
    monkeypatch.delenv("CLBRDF_MODELS", raising=False)
    path = tmp_path / "phong.py"
    path.write_text(PAGE, encoding="utf-8")
    return path


def scan_of(noise=0.02):
    theta_i, theta_r, phi = (
        a.ravel()
        for a in np.meshgrid([15.0, 40.0, 60.0], np.linspace(0.0, 25.0, 14), [180.0, 170.0], indexing="ij")
    )
    theta_r = theta_r + theta_i - 12.0  # about the mirror direction, where the cosine is positive
    d = Directions.relative(theta_i, theta_r, phi)
    f = phong(0.8, 35.0, 0.4, theta_i, theta_r, phi)[:, None] * [1.0, 0.9]
    f = f * (1.0 + noise * np.random.default_rng(1).standard_normal(f.shape))
    return Scan(d.theta_i, d.phi_i, d.theta_r, d.phi_r, [500.0, 600.0], f)


def test_a_page_is_evaluated_fitted_checked_saved_and_opened(page, tmp_path, monkeypatch, device):
    scan = scan_of()
    angles = scan.theta_i, scan.theta_r, scan.phi
    for precision in ("double", "single", "reference"):
        values = clbrdf.evaluate(
            {"ks": 0.5, "n": 30.0}, *angles, model=str(page), device=device, precision=precision
        )
        np.testing.assert_allclose(values, phong(0.5, 30.0, 0.3, *angles), rtol=1e-6)

    fit = clbrdf.fit(scan, model=str(page), weights="relative", device=device)
    assert fit.model.name == "phong"
    np.testing.assert_allclose(fit.parameters["n"], 35.0, rtol=0.1)
    assert set(fit.status.tolist()) == {"converged"}
    assert {v.word for v in check_fit(fit, effort=0.1)} == {"agreed"}
    shared = clbrdf.fit(scan, model=f"{page}+minnaert", shared=("phong.n",), fix={"kd": 0.0})
    assert shared.model.names == ("phong.ks", "phong.n", "phong.kd", "minnaert.rho", "minnaert.k")

    fit.save(tmp_path / "fit.h5")
    with pytest.raises(InputError, match=r"fit\.h5: its model 'phong' cannot be made: .*CLBRDF_MODELS"):
        Fit.open(tmp_path / "fit.h5")
    monkeypatch.setenv("CLBRDF_MODELS", str(tmp_path))
    again = Fit.open(tmp_path / "fit.h5")
    np.testing.assert_array_equal(again.evaluate(), fit.evaluate())
    assert "phong" in model_names()
    page.write_text(PAGE.replace('"n"', '"m"'), encoding="utf-8")
    with pytest.raises(InputError, match="had other parameters when it was fitted: m is not in the file"):
        Fit.open(tmp_path / "fit.h5")


def test_a_page_is_drawn(page, tmp_path):
    from clbrdf.viz.graphics import GraphicsError, require_off_screen

    try:
        require_off_screen()
    except GraphicsError as error:
        pytest.skip(str(error))
    from PIL import Image

    from clbrdf.cli import main

    scan_of().save(tmp_path / "scan.h5")
    os.environ["CLBRDF_MODELS"] = str(page.parent)
    try:
        assert (
            main(["fit", str(tmp_path / "scan.h5"), "-o", str(tmp_path / "fit.h5"), "--model", "phong"]) == 0
        )
        assert main(["view", str(tmp_path / "fit.h5"), "--png", str(tmp_path / "lobe.png")]) == 0
    finally:
        del os.environ["CLBRDF_MODELS"]
    picture = np.asarray(Image.open(tmp_path / "lobe.png").convert("L"), dtype=float)
    assert picture.std() > 5.0


def names_and_value(model):
    """Called in another process."""
    directions = Directions.relative([30.0], [30.0], [180.0])
    return model.names, float(model.brdf(model.defaults[None], model.features(directions))[0])


@pytest.mark.parametrize("name", ["{page}", "{page}+lambert", "hapke+rpv", "wang2013-fresnel"])
def test_models_go_to_other_processes(page, name):
    model = get_model(name.format(page=page), force=True)
    again = pickle.loads(pickle.dumps(model))
    assert again.names == model.names
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        assert pool.submit(names_and_value, model).result() == names_and_value(model)


def test_a_page_needs_nothing_of_the_tree(page):
    """In a fresh process, from another folder, by path and from the folder that CLBRDF_MODELS names."""
    code = "import clbrdf; print(clbrdf.evaluate({}, 30.0, 30.0, 180.0, model=%r)[0])"
    for name, more in ((str(page), {}), ("phong", {"CLBRDF_MODELS": str(page.parent)})):
        ended = subprocess.run(
            [sys.executable, "-c", code % name],
            capture_output=True,
            text=True,
            check=True,
            cwd=page.parent,
            env={**os.environ, **more},
        )
        assert float(ended.stdout) == pytest.approx(0.2 + 0.3 / np.pi, rel=1e-12)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("MODEL = ", "MY_MODEL = "), "holds no page"),
        (("ks * exp", "ks**2 * exp"), "not linear in ks"),
        (("import exp, greatest, log", "import exp, greatest, log, sin3"), "cannot import name 'sin3'"),
        (("value=value", "valu=value"), "unexpected keyword"),
        (("MODEL", "MODEL MODEL"), "SyntaxError"),
    ],
)
def test_mistakes_on_a_page_are_said_with_its_path(page, change, said):
    page.write_text(PAGE.replace(*change, 1), encoding="utf-8")
    with pytest.raises(InputError, match=said):
        get_model(str(page))


def test_a_page_that_is_not_there(tmp_path):
    with pytest.raises(InputError, match=r"gone\.py: a model's page cannot be read there"):
        get_model(str(tmp_path / "gone.py"))
