"""The examples of the documentation run, and print what the pages say."""

import importlib.util
import shutil
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FETCHED = ROOT.parent / "shared" / "data" / "formats" / "fred" / "AnoBlackEC1onAlum_fullAz.txt"


def load(name):
    spec = importlib.util.spec_from_file_location(f"docs_{name}", ROOT / "docs" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


examples = load("examples")
FOUND = [p for p in sorted((ROOT / "docs").glob("*.md")) if examples.BLOCK.search(p.read_text("utf-8"))]
# Of these the tutorial runs whole searches: a minute and more where no kernel is built yet.
PAGES = [pytest.param(p, marks=[pytest.mark.soak] if p.stem == "tutorial" else []) for p in FOUND]


@pytest.mark.parametrize("page", PAGES, ids=[page.stem for page in FOUND])
def test_examples_print_what_the_page_says(page, tmp_path):
    if FETCHED.name in page.read_text("utf-8"):
        if not FETCHED.exists():
            pytest.skip(f"{FETCHED.name} is not at hand, and tests fetch nothing")
        shutil.copy(FETCHED, tmp_path)
    ran = examples.run_page(page, tmp_path)
    assert ran
    for each in ran:
        assert each.exit_status == 0, (each.command, each.printed[-5:])
        assert examples.missing(each) == [], each.command


def test_a_line_that_is_not_printed_is_found():
    ran = examples.Ran("clbrdf info", ["status  3 converged", "…", "reciprocal"], ["status  9 converged"], 0)
    assert examples.missing(ran) == ["reciprocal"]
