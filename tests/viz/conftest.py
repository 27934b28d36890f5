"""Fits made by hand, and what pictures need of the machine."""

from __future__ import annotations

import shutil
import tempfile
from dataclasses import replace

import numpy as np
import pytest

from clbrdf import Fit, Scan
from clbrdf.fit.records import Estimate, Goodness, Search, Setup
from clbrdf.models import get_model
from clbrdf.viz.graphics import GraphicsError, require_off_screen
from clbrdf.viz.page import PageSubject, save_page
from clbrdf.viz.subject import Subject
from tests.reference.naive import TIN_FOIL
from tests.viz.browsing import browser_programs, comes_true, start_browser


@pytest.fixture(scope="session")
def gl() -> None:
    """Some OpenGL; tests that draw are skipped where there is none."""
    try:
        require_off_screen()
    except GraphicsError as error:
        pytest.skip(str(error))


def fit_of(scan: Scan, parameters: dict[str, object], status: str = "converged") -> Fit:
    """Return a fit with given parameters, each a number or (W,)."""
    model, w = get_model(), len(scan.wavelength)
    vector = np.stack([np.broadcast_to(np.asarray(parameters[n], float), w) for n in model.names], axis=1)
    none = np.zeros(vector.shape, dtype=np.bool_)
    ones = np.ones(w)
    return Fit(
        scan=scan,
        model=model,
        setup=Setup(np.ones(scan.brdf.shape), "none", model.bounds(), method="by hand"),
        estimate=Estimate(
            vector=vector,
            sigma=0.01 * np.abs(vector),
            correlation=np.full((w, len(model.names), len(model.names)), np.nan),
            condition=10.0 * ones,
            at_bound=none,
            undetermined=none,
        ),
        goodness=Goodness(
            objective=0.004 * ones,
            relative_rms=0.06 * ones,
            relative_rms_by_incident_angle=0.06 * np.ones((len(scan.incident_angles), w)),
            degrees=(len(scan) - len(model.names)) * ones,
            chi2_reduced=np.nan * ones,
            scatter=0.06 * ones,
            lag_one=0.1 * ones,
            lag_score=ones,
            lack_of_fit=np.nan * ones,
            repeats=np.zeros(w, np.int64),
        ),
        search=Search(
            device="none",
            evaluations=np.ones(w, np.int64),
            starts=np.full(w, 8),
            agreeing=np.full(w, 8),
            acceptance=0.4 * ones,
            not_finite=np.zeros(w, np.int64),
        ),
        status=np.array([status] * w),
        provenance={"weights": "none"},
    )


def fit_by_hand(scan, model):
    """Return a fit of any model with its default parameters."""
    fit = fit_of(scan, FOIL)
    w, size = len(scan.labels), len(model.names)
    vector = np.tile(model.defaults, (w, 1))
    none = np.zeros(vector.shape, dtype=np.bool_)
    estimate = replace(
        fit.estimate,
        vector=vector,
        sigma=0.01 * np.abs(vector),
        correlation=np.tile(np.eye(size), (w, 1, 1)),
        at_bound=none,
        undetermined=none,
    )
    return replace(fit, model=model, setup=replace(fit.setup, bounds=model.bounds()), estimate=estimate)


FOIL = dict(zip(get_model().names, TIN_FOIL, strict=True))


@pytest.fixture
def foil(small_scan) -> Subject:
    """The tin foil of Table 1, scaled with the wavelength as the scan is."""
    scale = np.array([0.9, 1.0, 1.1])
    fit = fit_of(small_scan, {**FOIL, "ks": FOIL["ks"] * scale, "kd": FOIL["kd"] * scale})
    return Subject("foil", fit.scan, fit, "fit.h5")


@pytest.fixture
def needle(small_scan) -> Subject:
    """A lobe whose full width at half height is 0.1°: its γ there is 0.025°."""
    v = 1.0 - np.cos(np.deg2rad(0.025))
    parameters = {"a": 0.0, "b": 0.0, "c": np.log(0.5) / v**0.74, "d": 0.74, "ks": 1000.0, "kd": 0.01}
    return Subject("needle", small_scan, fit_of(small_scan, parameters))


@pytest.fixture
def foil_file(foil, tmp_path):
    """The foil's fit in a file."""
    foil.fit.save(tmp_path / "fit.h5")
    return tmp_path / "fit.h5"


@pytest.fixture
def hemisphere() -> Scan:
    """A Lambertian and cosine lobe, measured all over the hemisphere at one wavelength, θi = 40°."""
    theta, phi = (a.ravel() for a in np.meshgrid(np.arange(0.0, 81.0, 10.0), np.arange(0.0, 360.0, 20.0)))
    values = 0.2 + 0.5 * np.cos(np.deg2rad(theta))
    return Scan([40.0], [0.0], theta, phi, [650.0], values[:, None], sample="plaster")


def all_masked(scan: Scan, column: int | None = None) -> Scan:
    """Return the scan with everything flagged, or everything at one wavelength."""
    flags = np.array(scan.flags)
    flags[:, slice(None) if column is None else column] |= np.uint32(1)
    return replace(scan, flags=flags)


@pytest.fixture(scope="session")
def browser():
    """A headless Chromium; tests that look through one are skipped where it is missing."""
    if None in browser_programs():
        pytest.skip("no Chromium with its driver here (Debian: apt-get install chromium chromium-driver)")
    pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
    folder = tempfile.mkdtemp(prefix="clbrdf-chromium-")
    driven = start_browser(folder)
    yield driven
    driven.quit()
    shutil.rmtree(folder, ignore_errors=True)


@pytest.fixture
def show(browser, tmp_path):
    """Write a page of subjects and open it, offline; whatever the browser complains of fails the test."""
    browser.get_log("browser")
    browser.set_network_conditions(offline=True, latency=0, throughput=0)

    def go(*subjects, fragment=""):
        path = tmp_path / "brdf.html"
        save_page(list(subjects), path, overwrite=True)
        browser.get("about:blank")
        browser.get(path.as_uri() + (f"#{fragment}" if fragment else ""))
        assert comes_true(lambda: browser.execute_script("return !!(window.clbrdf && clbrdf.frames)"))
        return browser

    yield go
    browser.delete_network_conditions()
    assert [line["message"] for line in browser.get_log("browser")] == []


@pytest.fixture
def foil_page(foil):
    return PageSubject(foil.name, foil.scan, foil.fit, "fit.h5")
