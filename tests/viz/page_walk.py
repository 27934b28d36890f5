"""Pages of all cases as files: sizes, times, and pictures. ``python -m tests.viz.page_walk DIR``.

Needs Chromium with its driver. Every page is drawn 400, 1280 and 3840 pixels wide, dark, and as printed.
"""

from __future__ import annotations

import base64
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

from clbrdf.cli.console import print_table
from clbrdf.viz.page import page_text, save_page
from clbrdf.viz.page.thin import LARGEST
from tests.viz.browsing import comes_true, start_browser
from tests.viz.page_cases import CASES, COATINGS

WIDTHS = (400, 1280, 3840)
STEPS = 12

FRAMES = """
const [step, count, done] = arguments;
const steps = {
  wavelength: (k) => clbrdf.act.column(null, k % clbrdf.subjects[0].columns),
  incident: (k) => clbrdf.act.incident(20 + k),
  turn: () => clbrdf.act.turn(4, 0),
}[step];
const began = performance.now();
let k = 0;
const next = () => {
  if (k === count) return done((1000 * count) / (performance.now() - began));
  steps(k++);
  requestAnimationFrame(() => setTimeout(next, 0));
};
next();
"""


def walk(folder: Path) -> list[list[str]]:
    """Write pages and pictures into a folder; return a row of figures a case."""
    folder.mkdir(parents=True, exist_ok=True)
    profile = tempfile.mkdtemp(prefix="clbrdf-chromium-")
    browser = start_browser(profile)
    rows = []
    try:
        for name, make in CASES.items():
            if name == "black_coating" and not COATINGS.is_dir():
                continue
            subject = make()
            path = folder / f"{name}.html"
            size = save_page([subject], path, overwrite=True)
            browser.get("about:blank")
            browser.get(path.as_uri())
            assert comes_true(lambda: browser.execute_script(DRAWN), 60)
            opened = browser.execute_script("return [clbrdf.firstPicture, clbrdf.wholePicture]")
            pictures(browser, folder / name)
            rows.append([name, *sizes(subject, size), *(f"{t / 1000:.2f}" for t in opened), *speeds(browser)])
            for line in browser.get_log("browser"):
                raise AssertionError(f"{name}: {line['message']}")
    finally:
        browser.quit()
        shutil.rmtree(profile, ignore_errors=True)
    return rows


def sizes(subject: Any, size: int) -> list[str]:
    """Directions × wavelengths, kB of sources, still pictures and data, and what is thinned."""
    text = page_text([subject])
    data = len(text.split('<script type="application/json" id="data">')[1].split("</script>")[0])
    stills = len(text.split("<noscript>")[1].split("</noscript>")[0])
    thinned = "; ".join(line.split(" are ")[0] for line in subject_words(subject)) or "nothing"
    shape = f"{len(subject.scan)} × {len(subject.scan.labels)}"
    return [
        shape,
        *(f"{n / 1000:.0f}" for n in (size - data - stills, stills, data)),
        f"{size / 1e6:.2f}",
        thinned,
    ]


def subject_words(subject: Any) -> list[str]:
    """What the page says that is left out."""
    from clbrdf.viz.page.record import subject_record

    return [line for line in subject_record(subject, LARGEST)["words"] if " of " in line]


def speeds(browser: Any) -> list[str]:
    """Pictures a second while the wavelength, the incident angle and the lobe move."""
    browser.set_script_timeout(120)
    return [
        f"{browser.execute_async_script(FRAMES, step, STEPS):.0f}"
        for step in ("wavelength", "incident", "turn")
    ]


def pictures(browser: Any, stem: Path) -> None:
    """Write what the page looks like on a phone, a desk, a wall, in the dark, and printed."""
    for width in WIDTHS:
        shoot(browser, width, stem.with_name(f"{stem.name}_{width}.png"))
    dark = [{"name": "prefers-color-scheme", "value": "dark"}]
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": dark})
    shoot(browser, 1280, stem.with_name(f"{stem.name}_dark.png"))
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})
    printed = browser.execute_cdp_cmd("Page.printToPDF", {"printBackground": False})
    stem.with_name(f"{stem.name}_print.pdf").write_bytes(base64.b64decode(printed["data"]))


def shoot(browser: Any, width: int, path: Path) -> None:
    """Write the whole page, drawn so many pixels wide."""
    size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 600}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    settle(browser)
    height = browser.execute_script("return document.documentElement.scrollHeight")
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {**size, "height": height})
    settle(browser)
    shot = browser.execute_cdp_cmd("Page.captureScreenshot", {"captureBeyondViewport": True})
    path.write_bytes(base64.b64decode(shot["data"]))
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def settle(browser: Any) -> None:
    """Wait until the page has been drawn in full."""
    browser.set_script_timeout(60)
    browser.execute_async_script("setTimeout(() => requestAnimationFrame(() => arguments[0]()), 400)")


DRAWN = "return !!(window.clbrdf && clbrdf.wholePicture)"
HEADS = [
    "case",
    "size",
    "page kB",
    "stills kB",
    "data kB",
    "MB",
    "left out",
    "first s",
    "λ /s",
    "θi /s",
    "turn /s",
]

if __name__ == "__main__":
    target = Path(sys.argv[1] if len(sys.argv) > 1 else "build/pages")
    print_table("the page: size and time", HEADS, walk(target))
