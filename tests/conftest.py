"""Fixtures that many tests share."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings

from clbrdf import Scan
from clbrdf.opencl.device import Device, list_devices

# Property tests have no time limit for one example: the machine may be busy with others.
settings.register_profile("clbrdf", deadline=None, derandomize=True)
settings.load_profile("clbrdf")

# No answer of tuning that a user keeps may change what is tested.
os.environ["CLBRDF_CACHE_DIR"] = tempfile.mkdtemp(prefix="clbrdf-tests-")

NEEDS = {"browser": "in a browser", "screen": "with a mouse in a window"}
"""Fixtures that need a program which not every machine has, and what tests with them are called."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Note what a test needs, so that its report tells."""
    for item in items:
        for name in NEEDS:
            if name in getattr(item, "fixturenames", ()):
                item.user_properties.append(("needs", name))


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> Iterator[None]:
    """Say at the very end how many tests of a kind ran, and how many were skipped and why."""
    yield

    def needs(report: object, name: str) -> bool:
        # A module that is skipped as a whole has a report of its own kind.
        return ("needs", name) in getattr(report, "user_properties", ())

    for name, words in NEEDS.items():
        reports = {
            kind: [r for r in terminalreporter.stats.get(kind, []) if needs(r, name)]
            for kind in ("passed", "failed", "error", "skipped")
        }
        skipped = len(reports.pop("skipped"))
        ran = sum(map(len, reports.values()))
        if skipped + ran:
            reasons = [
                r.longrepr[2].removeprefix("Skipped: ")
                for r in terminalreporter.stats.get("skipped", [])
                if needs(r, name) and isinstance(r.longrepr, tuple)
            ]
            why = f": {'; '.join(dict.fromkeys(reasons))}" if reasons else ""
            terminalreporter.write_line(f"tests {words}: {ran} ran, {skipped} skipped{why}")


COATINGS = Path(__file__).resolve().parents[2] / "shared" / "data" / "black_coatings"


@pytest.fixture(scope="session", params=list_devices(), ids=lambda device: device.platform.split()[0])
def device(request: pytest.FixtureRequest) -> Device:
    """Every OpenCL device of the machine in turn."""
    return request.param


@pytest.fixture(scope="session")
def coatings() -> Path:
    """Folder of real measured coatings, which stand beside the project and not in it."""
    if not COATINGS.is_dir():
        pytest.skip("the measured coatings (../shared/data) are not on this machine")
    return COATINGS


@pytest.fixture
def coating(request: pytest.FixtureRequest) -> Callable[[str, str], Scan]:
    """Scans of coatings by file and sample: the made one, which every clone has, and the real ones."""
    from clbrdf.formats.load import load_one
    from tests.coating import MADE, made_coating

    def scan_of(file: str, sample: str) -> Scan:
        if sample == MADE:
            return made_coating()
        return load_one([request.getfixturevalue("coatings") / file], sample)

    return scan_of


@pytest.fixture
def small_scan() -> Scan:
    """Three incident angles, 16 view angles, 3 wavelengths, Table 1 tin foil without noise."""
    from tests.reference.naive import TIN_FOIL, brdf

    theta_i = np.repeat([30.0, 45.0, 60.0], 16)
    theta_r = np.tile(np.linspace(0.0, 75.0, 16), 3)
    values = brdf(TIN_FOIL, theta_i, theta_r, 180.0)
    return Scan(
        theta_i,
        np.zeros(1),
        theta_r,
        np.full(1, 180.0),
        [450.0, 550.0, 650.0],
        values[:, None] * [0.9, 1.0, 1.1],
        sigma=0.05 * values[:, None] * np.ones(3),
        sample="foil",
        instrument="none",
        provenance={"made_by": "a test"},
    )
