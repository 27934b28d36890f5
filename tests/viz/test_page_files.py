"""The page as a file: what goes into it, how large it is, what it says of the scan."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

from clbrdf import InputError, Scan
from clbrdf.viz.page import PageSubject, open_for_page, page_text, save_page
from clbrdf.viz.page.record import computable, subject_record
from clbrdf.viz.page.thin import DIRECTION_BYTES, DOUBLE_BYTES, LARGEST, SINGLE_BYTES, thinning
from tests.viz.conftest import FOIL, fit_of


def test_the_page_fetches_nothing_and_is_small(foil_page):
    text = page_text([foil_page])
    assert "<title>foil: BRDF</title>" in text
    assert not re.search(r"(src|href)=[\"']?(https?:)?//", text)
    assert "default-src 'none'" in text
    assert len(text) < 400_000
    assert not re.search(r"\{\{[A-Z]+\}\}", text)


@pytest.mark.parametrize(
    ("directions", "wavelengths"), [(100_000, 4), (100, 2048), (10, 10), (5000, 5000), (1, 10**6), (10**6, 1)]
)
def test_thinning_keeps_the_budget_and_counts(directions, wavelengths):
    thin = thinning(directions, wavelengths, LARGEST, 248)
    n, w = len(thin.rows), len(thin.columns)
    each = DOUBLE_BYTES if thin.kind == "f8" else SINGLE_BYTES
    assert n * DIRECTION_BYTES + w * 248 + n * w * each <= LARGEST
    assert (np.diff(thin.rows) > 0).all()
    assert (np.diff(thin.columns) > 0).all()
    words = " ".join(thin.words)
    assert (f"{n} of {directions} directions" in words) == (n < directions)
    assert (f"{w} of {wavelengths} wavelengths" in words) == (w < wavelengths)


def test_a_large_scan_stays_below_five_megabytes():
    rng = np.random.default_rng(0)
    n = 100_000
    theta_r, phi = rng.uniform(0.0, 85.0, n), rng.uniform(0.0, 360.0, n)
    scan = Scan(30.0, 0.0, theta_r, phi, np.arange(400.0, 800.0, 100.0), rng.uniform(0.1, 1.0, (n, 4)))
    text = page_text([PageSubject("large", scan)])
    assert len(text) < 5_000_000
    assert "of 100000 directions are in this page" in text


def test_warnings_that_the_numbers_call_for(foil_page):
    lines = " ".join(subject_record(foil_page)["warnings"])
    assert "reflects more than it receives" in lines
    assert "not reciprocal" in lines
    assert "plane of incidence only" in lines
    assert json.dumps(subject_record(foil_page)["promises"]["theta_i"]) == "[30.0, 45.0, 60.0]"


def test_a_fit_of_transmission_leaves_its_scan(foil_page):
    both = Scan([30.0, 30.0], 0.0, [30.0, 150.0], 180.0, [550.0], [[0.3], [0.2]], sample="film")
    kept = computable(PageSubject("film", both, fit_of(both, FOIL)))
    assert kept.fit is None
    assert len(kept.scan) == 1
    assert "it holds transmission" in kept.said[-1]
    text = page_text([PageSubject("film", both, fit_of(both, FOIL))])
    assert text.count("data:image/png;base64,") == 2  # for readers without scripts, and for all
    assert computable(foil_page) is foil_page


def test_files(foil_file, small_scan, tmp_path):
    assert open_for_page(foil_file).fit is not None
    both = Scan([30.0, 30.0], 0.0, [30.0, 150.0], 180.0, [550.0], [[0.3], [0.2]], sample="film")
    both.save(tmp_path / "both.h5")
    assert "1 of 2 directions are of transmission" in open_for_page(tmp_path / "both.h5").said[0]
    with pytest.raises(InputError, match="holds 1 to 8 files"):
        page_text([])
    save_page([open_for_page(foil_file)], tmp_path / "a.html")
    with pytest.raises(InputError, match="exists already"):
        save_page([open_for_page(foil_file)], tmp_path / "a.html")
