"""Exchange formats written by hand: SSDD, BiRD, OpenMATERIAL, window data, pab-opto."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from clbrdf import InputError
from clbrdf.formats.guard import Options
from clbrdf.formats.load import load, load_one
from tests.formats import made_files as made
from tests.formats.looked_up import at
from tests.formats.made_files import F


@pytest.mark.parametrize("binary", [False, True])
def test_ssdd_runs_its_first_list_fastest(text, binary):
    loaded = load([text(made.ssdd(binary))])
    scan = next(iter(loaded.scans.values()))
    for k, theta_i in enumerate((0.0, 30.0, 60.0)):
        assert at(scan, theta_i, 45.0, 270.0) == pytest.approx([F + 0.001 * k], rel=1e-6)
    assert scan.wavelength.tolist() == [450.0, 650.0]
    assert scan.sample == "leaf"
    if not binary:
        assert any("specular reflectance: left out" in note for note in next(iter(loaded.notes.values())))


def test_the_examples_of_the_ssdd_specification(text):
    plain = "VERSION 0.2\n\nDATA_TYPE brdf\nCOLOR_MODEL monochrome\nPARAM_TYPE spherical_coordinate_system\n"
    plain += "PARAM0_LIST 0\nPARAM2_LIST 0\nPARAM3_LIST 0\nDATA ascii\n0.3183\n"
    assert load_one([text(plain)]).brdf.tolist() == [[0.3183]]
    half = "VERSION 0.2\n# Bluish\nDATA_TYPE brdf\nCOLOR_MODEL rgb\n"
    half += "PARAM_TYPE half_difference_coordinate_system\nREDUCTION_TYPE bilateral_symmetry reciprocity\n"
    half += "PARAM0_LIST 0 30\nPARAM2_LIST 0 50\nPARAM3_LIST 0 90\n"
    half += "DATA ascii\n# PARAM3: 0\n" + "0 0.05 0.16\n" * 8
    scan = load_one([text(half)])
    assert scan.bands == ("R", "G", "B")
    # θd = 0 is the retro direction of the half angle, θh = 0 the mirror direction of the difference angle.
    assert at(scan, 30.0, 30.0, 0.0, 1).tolist() == [0.05]
    assert at(scan, 50.0, 50.0, 180.0, 1)[0] == 0.05


@pytest.mark.parametrize("old", [False, True])
def test_bird_units_uncertainties_and_dialects(text, old):
    scan = load_one([text(made.bird(old))])
    assert scan.wavelength.tolist() == [550.0]
    assert np.unique(scan.phi_i).tolist() == [90.0]
    assert np.unique(scan.phi) == pytest.approx([0.0, 90.0, 180.0])
    assert scan.sigma == pytest.approx(0.02 * scan.brdf)
    assert scan.sample == "tile"


def test_bird_polarisations_become_scans(text):
    path = text(made.bird(polarization_i=("", ["s", "p"] * 9), polarization_r=("", ["unpolarized"] * 18)))
    scans = list(load([path]).scans.values())
    assert [(s.source_polarisation, s.detector_polarisation, len(s)) for s in scans] == [
        ("s", "unpolarised", 9),
        ("p", "unpolarised", 9),
    ]


def test_bird_fluorescence_is_refused(text):
    path = text(made.bird(wavelength_r=("nm", [550.0] * 17 + [620.0])))
    with pytest.raises(InputError, match="row 18: 550 nm comes in and 620 nm goes out"):
        load_one([path])


@pytest.mark.parametrize("forward", [0.0, math.pi])
def test_openmaterial_azimuth_is_told_by_the_peak(text, forward):
    loaded = load([text(made.openmaterial(forward))])
    scan = next(iter(loaded.scans.values()))
    assert scan.wavelength.tolist() == [905.0, 1550.0]
    bright = scan.brdf[:, 0] > 2 * F
    assert scan.phi[bright] == pytest.approx([180.0, 180.0])
    said = next(d for d in next(iter(loaded.decisions.values())) if d.name == "forward")
    assert said.taken == f"forward is φ = {np.rad2deg(forward):g}° in this file"


def test_openmaterial_without_a_peak_asks(text):
    path = text(made.openmaterial(forward=9.0))
    with pytest.raises(
        InputError, match=r"no peak stands out; settle it with --phi-forward 0 or --phi-forward 180"
    ):
        load_one([path])
    assert len(load_one([path], options=Options(forward=0.0))) == 20


def test_klems_totals_and_orientation(text):
    count = sum(ring[3] for ring in made.RINGS)
    rng = np.random.default_rng(2)
    matrix = rng.uniform(0.1, 0.4, (count, count))
    content = made.klems(lambda i, o: matrix[o, i])
    scan = next(iter(load([text(content)]).scans.values())).reflection()
    # The projected solid angle of each patch, from its bounds, and the row sums of the file's own text.
    patches = [
        math.pi / n * (math.sin(math.radians(high)) ** 2 - math.sin(math.radians(low)) ** 2)
        for _, low, high, n in made.RINGS
        for _ in range(n)
    ]
    assert sum(patches) == pytest.approx(math.pi)
    numbers = ET.fromstring(content).find(".//{*}ScatteringData").text.replace(",", " ").split()
    there = np.array(numbers, dtype=float).reshape(count, count)
    incident = sorted({(t, round(360.0 * k / n, 6)) for t, _, _, n in made.RINGS for k in range(n)})
    for place, (theta, phi) in enumerate(incident):
        rows = np.flatnonzero((scan.theta_i == theta) & (np.abs(scan.phi_i - phi) < 1e-6))
        assert len(rows) == count
        # Outgoing patches lie in the file's order, turned by half a turn.
        total = float(scan.brdf[rows, 0] @ patches)
        assert total == pytest.approx(float(there[:, place] @ patches), rel=1e-9)
    diagonal = np.isclose(scan.theta_i, scan.theta_r) & np.isclose(scan.phi, 180.0)
    assert sorted(scan.brdf[diagonal, 0]) == pytest.approx(sorted(np.diag(there)))


def test_klems_with_a_wavelength_is_a_wavelength(text):
    scan = load_one(
        [text(made.klems(wavelength='<Wavelength unit="Nanometer">550</Wavelength>'))], "blind front"
    )
    assert scan.wavelength.tolist() == [550.0]
    assert set(scan.side) == {"reflection", "transmission"}


def test_tensor_tree_cells_have_equal_projected_solid_angles(text):
    # 4 × 4 × 4 × 4 cells of 0.1; the first child refined to values of 0.2.
    leaf = "{" + "0.1 " * 16 + "}"
    fine = "{" + "0.2 " * 256 + "}"
    scan = load_one([text(made.tensor_tree("{" + fine + leaf * 15 + "}"))])
    assert len(scan) == 256 + 15 * 16
    assert np.unique(scan.brdf).tolist() == [0.1, 0.2]
    assert scan.theta_i.max() < 90.0
    three = load_one([text(made.tensor_tree("{" + "0.1 " * 512 + "}", "TensorTree3"))])
    assert len(three) == 256
    # dimension 0 at (k + 1/2)/8 is (1 − sinθi)/2.
    assert np.unique(np.round(np.sin(np.deg2rad(three.theta_i)), 9)) == pytest.approx(
        [0.125, 0.375, 0.625, 0.875]
    )


def test_pab_dsf_is_divided_by_the_cosine(text):
    for kind in ("DSF", "BSDF"):
        scan = load_one([text(made.pab(kind))])
        assert at(scan, 30.0, 75.0, 90.0) == pytest.approx([F])
        assert at(scan, 30.0, 30.0, 180.0) == pytest.approx([5 * F])
        assert scan.sample == "cloth"
