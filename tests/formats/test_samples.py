"""Real files: each imports by itself, or with the option that is asked for."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from clbrdf import InputError
from clbrdf.formats.guard import Options
from clbrdf.formats.load import load
from clbrdf.formats.vectors import to_specular
from tests.formats.conventions import offered

SAMPLES = Path(__file__).resolve().parents[3] / "shared" / "data" / "formats"
pytestmark = pytest.mark.skipif(
    not SAMPLES.is_dir(), reason="real files (../shared/data) are not on this machine"
)

CUT = "2011-SA1-Small-CommaSeparated.XML"
"""A file of 2 × 2 values that claims 145 patches: refused, as a cut file is."""

ASKED = {
    "test_brdf_viewer_2D_data.csv": Options(scale="pi"),
    "test_jdv.jdv": Options(forward=180.0),
    "test_raywiz.jdv": Options(forward=180.0),
    "test_speos.rtd": Options(forward=180.0),
    "test_lighttools.txt": Options(forward=180.0),
}
"""Of those that the guard asks about; the four gonio-photometer files hold raw counts below zero."""


def files() -> list[Path]:
    return [path for path in sorted(SAMPLES.glob("*/*")) if path.suffix and path.name != CUT]


@pytest.mark.parametrize("path", files(), ids=lambda path: path.name)
def test_it_imports_with_at_most_the_option_that_is_asked_for(path):
    options = ASKED.get(path.name)
    if path.parent.name == "rgl" and "rgl" not in formats_known():
        pytest.skip("RGL files are read by a part that is not here")
    if options is not None:
        with pytest.raises(InputError, match="settle it with") as error:
            load([path])
        assert options in offered(str(error.value))
    loaded = load([path], options=options)
    for name, scan in loaded.scans.items():
        print(line(path, loaded.formats[0], name, scan, loaded.decisions[name]))
        taken = [d for d in loaded.decisions[name] if d.name != "check"]
        assert {d.name for d in taken} >= {"angle", "forward", "cosine", "scale"}
        assert not any("more than comes in" in d.why for d in loaded.decisions[name])


def formats_known():
    from clbrdf.formats.registry import formats

    return formats()


def line(path, format_name, name, scan, decisions) -> str:
    """One row of the table: file, format, size, reflectance, peak, and what was decided."""
    reflects = next((d.taken for d in decisions if d.taken.startswith("reflects")), "–")
    peak = next((d.why.rpartition("; ")[2] for d in decisions if d.name == "forward"), "")
    said = "; ".join(d.taken for d in decisions if d.name in ("forward", "cosine", "scale", "origin", "swap"))
    size = f"{scan.brdf.shape[0]} × {scan.brdf.shape[1]}"
    return f"{path.name} | {format_name} | {name} | {size} | {reflects} | {peak} | {said}"


def test_a_file_that_is_cut_is_refused():
    with pytest.raises(InputError, match=r"4 values, and .* need 145 × 145 = 21025"):
        load([SAMPLES / "klems" / CUT])


def test_the_same_vinyl_in_zemax_and_in_speos():
    """Two exporters wrote one measurement: after both conversions the values agree."""
    zemax = next(iter(load([SAMPLES / "zemax" / "BrownVinyl_IS-SA_ansys.bsdf"]).scans.values()))
    name = "test_13_planesymmetric_brdf_speos_reference.anisotropicbsdf"
    speos = next(iter(load([SAMPLES / "speos" / name]).scans.values()))

    # Speos counts from the normal and has 5° × 10°; Zemax's nodes near the normal lie close to some of them.
    tree = cKDTree(np.stack([zemax.theta_i * 10, *plane(zemax)], axis=1))
    inside = speos.theta_r <= 60.0
    azimuth, radial = to_specular(speos.theta_i, speos.theta_r, speos.phi)
    inside &= (radial < 60.0) & (speos.theta_i <= 45.0) & (np.abs(azimuth) >= 0.0)
    distance, place = tree.query(np.stack([speos.theta_i * 10, *plane(speos)], axis=1)[inside])
    near = distance < 0.02
    ratio = speos.brdf[inside, 0][near] / zemax.brdf[place[near], 0]
    assert near.sum() > 50
    # The Speos file was scaled by the other one's TIS, which is some 5 % above the integral of its values.
    assert np.median(ratio) == pytest.approx(1.05, abs=0.05)


def plane(scan):
    r, p = np.deg2rad(scan.theta_r), np.deg2rad(scan.phi)
    return np.sin(r) * np.cos(p), np.abs(np.sin(r) * np.sin(p))
