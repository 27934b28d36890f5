"""Every format against files written by hand: what is in them comes out, in our conventions."""

from __future__ import annotations

import math
import time
import tracemalloc
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from clbrdf import InputError
from clbrdf.formats import merl, utia
from clbrdf.formats.guard import Options
from clbrdf.formats.load import load, load_one
from clbrdf.formats.registry import find_format, formats
from clbrdf.formats.vectors import (
    from_half_difference,
    from_specular,
    to_half_difference,
    to_specular,
)
from tests.formats import made_files as made
from tests.formats.made_files import RHO, F


@pytest.fixture
def text(tmp_path):
    def put(content, name="file.txt"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode("utf-8"))
        return path

    return put


def at(scan, theta_i, theta_r, phi, column=0):
    """The values in directions near to one."""
    turn = np.abs(np.mod(scan.phi - phi + 180.0, 360.0) - 180.0)
    near = (np.abs(scan.theta_i - theta_i) < 0.01) & (np.abs(scan.theta_r - theta_r) < 0.01)
    near &= (turn < 0.01) | (np.minimum(theta_r, 180.0 - theta_r) == 0.0)
    assert near.any(), (theta_i, theta_r, phi)
    return scan.brdf[near, column]


@pytest.mark.parametrize("name", made.TEXTS)
def test_the_content_tells_the_format(name, tmp_path):
    expected = {
        "aniso": "speos",
        "old bird": "bird",
        "klems": "window",
        "tree": "window",
        "factors": "columns",
    }
    path = made.write_all(tmp_path)[name]
    assert find_format(path).name == expected.get(name, name)
    # The ending of its name has no part in it.
    other = path.rename(path.with_suffix(".xyz"))
    if name != "openmaterial":
        assert find_format(other).name == expected.get(name, name)


def test_zemax_geometry_against_vectors_worked_by_hand(text):
    # θi = 40°, r = 10°: towards the normal (a = 0) the zenith is 30°, away from it (180) 50°, both forward.
    # Across (a = 90): z = cos 10 cos 40 = 0.754407, θr = 41.0288°; x = −cos 10 sin 40, y = sin 10:
    # the azimuth is 180 − atan(0.173648 / 0.633022) = 164.6597°.
    scan = load_one([text(made.zemax(values=lambda i, a, r: 1.0 + i + (a / 1000.0 if r else 0.0) + r / 1e6))])
    assert scan.wavelength.tolist() == [633.0]
    assert scan.sample == "made"
    for theta_r, phi, a in ((30.0, 180.0, 0.0), (50.0, 180.0, 180.0), (41.0288, 164.6597, 90.0)):
        assert at(scan, 40.0, theta_r, phi) == pytest.approx([41.0 + a / 1000.0 + 10 / 1e6])
    assert at(scan, 40.0, 40.0, 180.0) == pytest.approx([41.0])
    # r = 60 towards the normal passes it: θr = 20° on the side of the source.
    assert at(scan, 40.0, 20.0, 0.0) == pytest.approx([41.0 + 60 / 1e6])
    # r = 60 away from the normal lies at 100°, below the horizon.
    assert len(scan) == 2 * (1 + 3 * 3) - 1


def test_specular_and_half_angles_have_inverses():
    rng = np.random.default_rng(4)
    i, r = rng.uniform(0.5, 89.5, (2, 500))
    p = rng.uniform(0.0, 360.0, 500)
    back = from_specular(i, *to_specular(i, r, p))
    np.testing.assert_allclose(back[0], r, atol=1e-9)
    np.testing.assert_allclose(np.cos(np.deg2rad(back[1] - p)), 1.0, atol=1e-12)
    half = to_half_difference(i, r, p)
    again = from_half_difference(*half)
    # φd is kept within half a turn: the other half is the exchange of source and view.
    same = np.abs(again[0] - i) < 1e-7
    exchanged = (np.abs(again[0] - r) < 1e-7) & (np.abs(again[1] - i) < 1e-7)
    assert (same | exchanged).all()


def test_astm_in_radians_and_both_dialects(text):
    scan = load_one([text(made.astm())])
    assert np.unique(scan.theta_i) == pytest.approx(np.rad2deg([0.3, 0.9]))
    assert np.unique(scan.phi) == pytest.approx([0.0, 90.0, 180.0])
    assert scan.sample == "paint"
    quirk = text(made.astm("theta_i,phi_i,theta_s,R,G"), "quirk.txt")
    told = load([quirk])
    assert next(iter(told.scans.values())).bands == ("R", "G")
    assert "VARS leaves out phi_s" in next(iter(told.notes.values()))[0]


def test_speos_percent_sets_the_scale(text):
    for intensity in (False, True):
        scan = load_one([text(made.speos(intensity))])
        assert scan.wavelength.tolist() == [450.0, 550.0]
        # Between rings 30° apart the cosine of an intensity is no straight line: 2.4 % in all.
        near = 0.03 if intensity else 1e-9
        # A Lambertian that scatters 40 % has f = 0.4/π, whatever the table's own scale.
        assert at(scan, 0.0, 30.0, 0.0, 0) == pytest.approx([0.4 / math.pi], rel=near)
        assert at(scan, 45.0, 60.0, 90.0, 1) == pytest.approx([0.1 / math.pi], rel=near)
        assert at(scan, 45.0, 120.0, 90.0, 0) == pytest.approx([0.3 / math.pi], rel=near)
        assert set(scan.side) == {"reflection", "transmission"}


def test_speos_forward_is_azimuth_0(text):
    lines = made.speos().split("\n")
    row = lines.index("60 " + " ".join(["7.0"] * 5))
    lines[row] = "60 14.0 7.0 7.0 7.0 14.0"
    scan = load_one([text("\n".join(lines))])
    bright = scan.brdf[:, 0] > 1.5 * scan.brdf[0, 0]
    assert scan.phi[bright].tolist() == [180.0]


def test_anisotropic_speos_has_rotations(text):
    scan = load_one([text(made.anisotropic())])
    assert scan.rotations().tolist() == [0.0, 90.0]
    # The spectrum belongs to rotation 0; the other one is twice as bright.
    by_rotation = [np.unique(np.round(scan.brdf[scan.phi_i == angle], 9)) for angle in (0.0, 90.0)]
    assert by_rotation[0] == pytest.approx([0.4 / math.pi])
    assert by_rotation[1] == pytest.approx([0.8 / math.pi])


@pytest.mark.parametrize(("angles", "bsdf"), [("deg", "value"), ("sin", "value"), ("deg", "log")])
def test_fred_settings(text, angles, bsdf):
    scan = load_one([text(made.fred(angles, bsdf))])
    assert at(scan, 20.0, 20.0, 180.0) == pytest.approx([3.0 * F])
    assert at(scan, 50.0, 70.0, 0.0) == pytest.approx([F])
    assert scan.bands == ("monochrome",)


def test_lighttools_turns_by_90_degrees_and_has_three_parts(text):
    loaded = load([text(made.lighttools())])
    front, back = loaded.scans.values()
    assert at(front, 40.0, 40.0, 180.0) == pytest.approx([2 * F])
    assert at(front, 20.0, 140.0, 180.0) == pytest.approx([2 * F])
    assert at(front, 20.0, 80.0, 0.0) == pytest.approx([F])
    assert set(back.side) == {"reflection"}


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
    with pytest.raises(InputError, match=r"no peak stands out; settle it with forward=0 or forward=180"):
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


def test_reflectance_factors_are_pi_f(text):
    scan = load_one([text(made.factors())])
    assert scan.brdf == pytest.approx(F)
    assert scan.wavelength.tolist() == [600.0, 900.0]
    assert scan.bandpass.tolist() == [10.0, 12.0]


def test_wide_tables_with_text_above(text):
    scan = load_one([text(made.wide())])
    assert scan.wavelength.tolist() == [450.5, 650.0]
    assert scan.brdf == pytest.approx(np.tile([F, F / 2], (18, 1)))


def test_utia(text):
    scan = load_one([text(made.utia())], options=Options(scale="1"))
    assert scan.brdf.shape == (288 * 288, 3)
    assert scan.bands == ("R", "G", "B")
    # The file runs over view azimuths fastest.
    first = utia.read(text(made.utia()))[0]
    assert first.phi_r[:3].tolist() == [0.0, 7.5, 15.0]
    assert first.theta_r[48] == 15.0


@pytest.fixture(scope="module")
def merl_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("merl") / "made.binary"
    path.write_bytes(made.merl())
    return path


class TestMerl:
    def test_values_and_directions(self, merl_file):
        scan = load_one([merl_file])
        assert scan.bands == ("R", "G", "B")
        assert scan.brdf == pytest.approx(F)
        assert scan.theta_i.max() < 90.0
        assert scan.theta_r.max() < 90.0

    def test_a_cell_against_vectors(self):
        # θh = 10°, θd = 40°, φd = 90°: h = (sin 10, 0, cos 10), d = (0, sin 40, cos 40) turned 10° about y.
        h, d = math.radians(10.0), math.radians(40.0)
        source = np.array([math.sin(h) * math.cos(d), math.sin(d), math.cos(h) * math.cos(d)])
        half = np.array([math.sin(h), 0.0, math.cos(h)])
        view = 2.0 * (source @ half) * half - source
        theta_i, theta_r, phi = from_half_difference(np.array([10.0]), np.array([40.0]), np.array([90.0]))
        assert theta_i[0] == pytest.approx(math.degrees(math.acos(source[2])))
        assert theta_r[0] == pytest.approx(math.degrees(math.acos(view[2])))
        turn = math.degrees(math.atan2(view[1], view[0]) - math.atan2(source[1], source[0])) % 360.0
        assert phi[0] == pytest.approx(turn)

    def test_35_megabytes_quickly_and_in_little_memory(self, merl_file):
        start = time.perf_counter()
        merl.read(merl_file)
        seconds = time.perf_counter() - start
        tracemalloc.start()
        load_one([merl_file])
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        # 3 s are asked for, 1 s is usual; a busy machine may take three times as long.
        assert seconds < 9.0
        assert peak < 5 * merl_file.stat().st_size

    def test_a_cut_file_is_refused(self, merl_file, tmp_path):
        cut = tmp_path / "cut.binary"
        cut.write_bytes(merl_file.read_bytes()[:-8])
        with pytest.raises(InputError, match=r"has 34992004 bytes, and 34992012 are needed"):
            load_one([cut])


def test_several_files_join_into_one_scan(text):
    parts = [
        made.long_csv().replace("\nfoil,650", "\n#foil,650"),
        made.long_csv().replace("\nfoil,450", "\n#foil,450"),
    ]
    scan = load_one([text(parts[0], "a.csv"), text(parts[1], "b.csv")])
    assert scan.wavelength.tolist() == [450.0, 650.0]
    assert not scan.mask.any()
    assert len(scan) == 16


SEMICOLONS = made.long_csv().replace(",", ";")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty"),
        (b"\x89PNG\r\n\x1a\n\x00\x00\x00\r", "not a text file .byte 6 is 26., and of no known binary format"),
        (made.long_csv().replace("\nfoil", '\n"foil', 1).encode(), "a quote that does not close"),
        (made.bird(uBRDF=("1/sr", [math.inf] * 18)).encode(), r"bad\.csv: sigma\[0, 0\] is inf"),
        (b"hello world\n", "no data; the first line names the columns"),
        (SEMICOLONS.replace("0.01", "0;01").encode(), "9 cells, and the first line names 8"),
        (SEMICOLONS.replace("0.01", "0,01").encode(), "'0,01' is not a number; write decimal points"),
        (made.zemax().replace("Radial\t4", "Radial\t400000000").encode(), "is no number of angles"),
        (made.zemax().replace("ScatterRadial\t4", "ScatterRadial\t9999").encode(), "is not a number|keyword"),
        (made.zemax().split("DataEnd")[0][:-40].encode(), "ends where|is not a number|more than|TIS"),
        (made.ssdd(True)[:-4], r"the lists ask for 360 bytes, and 356 follow DATA"),
        (made.ssdd().replace(b"PARAM0_LIST 0 30", b"PARAM0_LIST 0 1 2"), "'DATA_TYPE' is not a number"),
        (made.klems().replace("0.127323954", "x", 1).encode(), "'x' is not a number"),
        (made.klems()[:-30].encode(), "no XML"),
        (made.bird().replace('"deg"', '"gon"', 1).encode(), "data.theta_i: unit 'gon' is not known"),
        (made.bird().replace('"BRDF"', '"brdf_"').encode(), "no data; the first line"),
        (made.bird()[:-20].encode(), r"line 1: no JSON"),
        (made.astm().replace("NUM_POINTS 18", "NUM_POINTS 19").encode(), "18 rows, and 19 are needed"),
        (made.fred().replace("20.0 0", "20.0", 1).encode(), "two numbers|numbers; rows have 3"),
        (made.speos().replace("2 2", "99999 99999", 1).encode(), "incidences|99999"),
        (made.speos().replace("\n0\n", "\n1\n", 1).encode(), "only text files"),
    ],
)  # fmt: skip
def test_bad_files_get_one_line(text, content, message):
    with pytest.raises(InputError, match=message) as error:
        load([text(content, "bad.csv")])
    assert "bad.csv" in str(error.value)
    assert "\n" not in str(error.value)


def test_a_file_in_windows_encoding_is_read(text):
    content = ("# Büro, 25 °C\n" + made.long_csv()).encode("cp1252")
    assert len(load_one([text(content)])) == 16
    assert len(load_one([text(made.long_csv().encode("utf-16"))])) == 16


def test_every_format_says_what_it_is():
    for name, each in formats().items():
        assert each.name == name
        assert each.title
        assert all(ending.startswith(".") for ending in each.endings)
        assert bool(each.holds) == (each.write is not None)


def test_rho_is_what_pi_f_says():
    assert math.pi * F == pytest.approx(RHO)
