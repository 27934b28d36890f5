"""The page that turns: complete in itself, and turning in a real browser without a network."""

from __future__ import annotations

import io
import re
import sys
import time

import numpy as np
import pytest
from PIL import Image

from clbrdf import InputError
from clbrdf.viz.html import save_html, scene_archive
from clbrdf.viz.panel import Entry
from clbrdf.viz.scene import Scene
from clbrdf.viz.style import Look

pytestmark = pytest.mark.usefixtures("gl")


@pytest.fixture
def page(foil, tmp_path):
    pytest.importorskip("trame_vtk", reason="trame-vtk is not installed (extra 'web')")
    scene = Scene([Entry(foil, 550.0, 45.0)], Look(radius="log"), words=False, flat_labels=True)
    save_html(scene, tmp_path / "lobe.html")
    scene.close()
    return tmp_path / "lobe.html"


def test_the_page_says_what_it_shows_and_fetches_nothing(page):
    text = page.read_text(encoding="utf-8")
    assert "<title>foil: BRDF</title>" in text
    for words in ("θi = 45°,  λ = 550 nm", "peak 657.", "logarithmic from", "Drag to turn"):
        assert words in text
    assert not re.search(r"<(script|link|img)[^>]+(src|href)=[\"']?(https?:)?//", text)
    assert "favicon-" not in text
    assert len(text) < 4_000_000


def test_an_existing_page_is_kept(foil, page):
    scene = Scene([Entry(foil, 550.0, 45.0)], words=False, flat_labels=True)
    with pytest.raises(InputError, match="exists already"):
        save_html(scene, page)
    scene.close()


def test_without_trame(foil, monkeypatch):
    scene = Scene([Entry(foil, 550.0, 45.0)], words=False, flat_labels=True)
    monkeypatch.setitem(sys.modules, "trame_vtk.modules.vtk.serializers", None)
    with pytest.raises(InputError, match=r"pip install 'clbrdf\[web\]'"):
        scene_archive(scene)
    scene.close()


def picture(browser) -> np.ndarray:
    with Image.open(io.BytesIO(browser.get_screenshot_as_png())) as image:
        return np.asarray(image.convert("RGB")).astype(int)


def coloured(image: np.ndarray) -> int:
    """Pixels with a strong colour: the lobe."""
    return int(((image.max(axis=2) - image.min(axis=2)) > 60).sum())


def settled(browser, enough) -> np.ndarray:
    """Return the first picture that is `enough`, or the last one before patience ends."""
    patience = time.monotonic() + 30.0
    while True:
        image = picture(browser)
        if enough(image) or time.monotonic() > patience:
            return image
        time.sleep(0.2)


def test_it_opens_offline_and_turns(page, browser):
    from selenium.webdriver import ActionChains

    browser.get_log("browser")
    browser.set_network_conditions(offline=True, latency=0, throughput=0)
    try:
        browser.get(page.as_uri())
        before = settled(browser, lambda image: coloured(image) > 2000)
        assert coloured(before) > 2000
        drag = ActionChains(browser, duration=20).move_by_offset(500, 420).click_and_hold()
        for _ in range(6):
            drag = drag.move_by_offset(20, 4)
        drag.release().perform()
        after = settled(browser, lambda image: (np.abs(image - before).max(axis=2) > 60).sum() > 5000)
        changed = np.abs(after - before).max(axis=2) > 60
        assert changed.sum() > 5000
        assert coloured(after) > 1000
        # The words above stay where they are.
        assert not changed[:30, :300].any()
        errors = [line for line in browser.get_log("browser") if line["level"] == "SEVERE"]
        assert errors == []
    finally:
        browser.delete_network_conditions()
