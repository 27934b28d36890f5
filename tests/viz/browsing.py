"""What tests in a browser share."""

from __future__ import annotations

import shutil
import time

import numpy as np


def comes_true(claim, patience=20.0):
    """Whether a claim about the page comes true, given some time."""
    end = time.monotonic() + patience
    while not claim():
        if time.monotonic() > end:
            return False
        time.sleep(0.05)
    return True


def readout(browser):
    """Numbers that the readout shows, in full, by name."""
    script = """return [...document.querySelectorAll('#readout [data-value]')]
        .map(e => [e.dataset.name, e.dataset.value])"""
    return {name: float(value) for name, value in browser.execute_script(script)}


def shows(browser, name, value, tolerance=1e-9):
    """Whether a number of the readout comes to a value."""
    return comes_true(lambda: abs(readout(browser).get(name, np.inf) - value) <= tolerance)


def settled(browser):
    """Wait until the page has drawn what was asked for: nothing moves on it any more."""
    browser.set_script_timeout(60)
    browser.execute_async_script(
        """const done = arguments[0];
        let before = -1;
        const look = () => {
          if (clbrdf.frames === before) return done();
          before = clbrdf.frames;
          setTimeout(() => requestAnimationFrame(look), 250);
        };
        look();"""
    )


def browser_programs():
    """Chromium and its driver, each None where it is missing."""
    names = ("chromium", "chromium-browser", "google-chrome")
    chromium = next((path for path in map(shutil.which, names) if path), None)
    return chromium, shutil.which("chromedriver")


def start_browser(folder):
    """Start a headless Chromium whose profile lies in a folder."""
    from selenium import webdriver

    chromium, driver = browser_programs()
    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    for word in (
        "--headless=new",
        "--no-sandbox",
        "--disable-gpu",
        "--disable-background-networking",
        "--disable-dev-shm-usage",
        "--window-size=1000,800",
        f"--user-data-dir={folder}",
    ):
        options.add_argument(word)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    return webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))
