"""Measured text: what is read, what is masked, what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from clbrdf import InputError
from clbrdf.formats.load import load, load_one

HEADER = "sample,wavelength_nm,theta_i_deg,theta_r_deg,dphi_deg,fr_per_sr,fr_std_per_sr,flag"
ROW = "foil,550,30,20,180,1.5,0.1,"


def write(folder, *lines, name="data.csv"):
    path = folder / name
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_a_plain_file(tmp_path):
    scan = load_one([write(tmp_path, HEADER, ROW, "foil,450,30,20,180,1.2,,", "foil,450,30,40,0,1.1,,")])
    assert scan.sample == "foil"
    assert scan.wavelength.tolist() == [450.0, 550.0]
    assert list(zip(scan.theta_r.tolist(), scan.phi.tolist(), strict=True)) == [(20.0, 180.0), (40.0, 0.0)]
    np.testing.assert_array_equal(scan.brdf, [[1.2, 1.5], [1.1, np.nan]])
    np.testing.assert_array_equal(scan.sigma, [[np.nan, 0.1], [np.nan, np.nan]])
    assert scan.flag_counts() == {"not_measured": 1}


def test_names_in_any_case_order_unit_and_separator(tmp_path):
    path = write(
        tmp_path,
        "# measured on a Tuesday",
        "",
        "FR_per_sr;Theta_R_rad;THETA_I_DEG;Wavelength_um;phi_i_deg;phi_r_deg;operator",
        "1.5;0.5235987755982988;45;0.55;350;170;somebody",
    )
    scan = load_one([path])
    assert scan.theta_r[0] == pytest.approx(30.0, rel=1e-15)
    assert (scan.theta_i[0], scan.phi[0], scan.wavelength[0]) == (45.0, 180.0, pytest.approx(550.0))


def test_byte_order_mark_and_windows_lines(tmp_path):
    path = tmp_path / "windows.csv"
    path.write_bytes(("\ufeff" + HEADER + "\r\n" + ROW + "\r\n").encode("utf-8"))
    assert load_one([path]).brdf.tolist() == [[1.5]]


def test_flagged_rows_are_masked_with_the_reason_kept(tmp_path):
    rows = [
        "foil,550,30,20,180,1.5,,saturated;shaded",
        "foil,550,30,21,180,1.5,,saturated",
        "foil,550,30,22,180,1,,",
    ]
    scan = load_one([write(tmp_path, HEADER, *rows)])
    assert scan.mask[:, 0].tolist() == [True, True, False]
    assert scan.flag_counts() == {"saturated": 2, "shaded": 1}


def test_bad_values_are_masked_and_counted(tmp_path):
    values = ["nan", "inf", "0", "-1", "", "2.5"]
    rows = [f"foil,550,30,{k},180,{value},," for k, value in enumerate(values)]
    scan = load_one([write(tmp_path, HEADER, *rows)])
    assert scan.mask[:, 0].tolist() == [True] * 5 + [False]
    assert scan.flag_counts() == {
        "not_measured": 1,
        "not_a_number": 1,
        "infinite": 1,
        "zero": 1,
        "negative": 1,
    }


def test_repeated_directions_stay_apart(tmp_path):
    rows = ["foil,550,0,45,0,1.0,,", "foil,650,0,45,0,1.1,,", "foil,550,0,45,0,1.2,,"]
    scan = load_one([write(tmp_path, HEADER, *rows)])
    np.testing.assert_array_equal(scan.brdf, [[1.0, 1.1], [1.2, np.nan]])
    assert scan.repeated_directions() == 1


def test_one_wavelength_a_file(tmp_path):
    first = write(tmp_path, HEADER, ROW, name="a.csv")
    second = write(tmp_path, HEADER, ROW.replace("550", "650"), name="b.csv")
    scan = load_one([first, second])
    assert scan.wavelength.tolist() == [550.0, 650.0]
    assert scan.provenance["input"] == "a.csv; b.csv"


def test_samples_are_chosen_by_name(tmp_path):
    path = write(tmp_path, HEADER, ROW, ROW.replace("foil", "tile"))
    with pytest.raises(InputError, match="holds 2 samples; choose one with --sample: 'foil', 'tile'"):
        load_one([path])
    with pytest.raises(InputError, match="no sample is called 'wood'; there are 'foil', 'tile'"):
        load_one([path], "wood")
    assert load_one([path], "tile").sample == "tile"


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ([], r"data\.csv: no data"),
        ([HEADER], r"data\.csv: no data"),
        (
            [HEADER.replace("theta_i_deg,", ""), "foil,550,20,180,1,,"],
            "no column for theta_i; name it like theta_i_deg",
        ),
        ([HEADER.replace("dphi_deg,", ""), "foil,550,30,20,1,,"], "no column for phi; name it like dphi_deg"),
        (
            [HEADER.replace("_nm", "_furlong"), ROW],
            "'wavelength_furlong' has the unit 'furlong'; known are nm, angstrom, um, mm, m",
        ),
        (
            [HEADER.replace("_nm", ""), ROW.replace("550", "55")],
            "55 to 55 may be in nm or in µm; .* --unit nm",
        ),
        ([HEADER.replace("_per_sr", ""), ROW], "nothing says what scale values have .* --scale 1 or"),
        ([HEADER.replace("fr_per_sr", "fr_percent"), ROW], "'fr_percent' has the unit 'percent'"),
        ([HEADER + ",brdf_per_sr", ROW + ",1"], "'fr_per_sr' and 'brdf_per_sr' both give brdf"),
        ([HEADER, "foil,550,30,20,180,1.5,0.1"], "line 2: 7 cells, and the first line names 8 columns"),
        ([HEADER, ROW, ROW + ",x"], "line 3: 9 cells"),
        ([HEADER, ROW.replace("1.5", "bright")], "line 2, column fr_per_sr: 'bright' is not a number"),
        ([HEADER, ROW.replace("30", "thirty")], "line 2, column theta_i_deg: 'thirty' is not a number"),
        ([HEADER, ROW.replace("30", "")], "line 2, column theta_i_deg: '' is not a number"),
        ([HEADER, ROW.replace(",30,", ",90,")], r"all 1 directions lie on the horizon"),
        ([HEADER, ROW.replace(",30,", ",95,")], r"line 2: the incident zenith 95° is out of range"),
        ([HEADER, ROW.replace("180", "inf")], "line 2, column dphi_deg: inf is out of range"),
        (
            [HEADER, ROW.replace("550", "0")],
            "line 2, column wavelength_nm: 0 is no wavelength of light",
        ),
        (
            [HEADER, ROW.replace("0.1", "-0.1")],
            "line 2, column fr_std_per_sr: -0.1 cannot be a standard uncertainty; give 0 or more",
        ),
        ([HEADER, *(f"foil,550,30,{k},180,1,,why{k}" for k in range(28))], "28 different flags; at most 27"),
    ],
)
def test_bad_text_is_refused_with_its_place(tmp_path, lines, message):
    with pytest.raises(InputError, match=message):
        load_one([write(tmp_path, *lines)])


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "utf-32"])
def test_encodings(tmp_path, encoding):
    path = tmp_path / "data.csv"
    path.write_bytes("\n".join([HEADER, ROW, ROW.replace(",20,", ",40,")]).encode(encoding))
    assert load_one([path]).theta_r.tolist() == [20.0, 40.0]


@pytest.mark.parametrize("separator", [";", "\t"])
def test_decimal_commas(tmp_path, separator):
    row = ROW.replace(",", separator).replace(".", ",")
    loaded = load([write(tmp_path, HEADER.replace(",", separator), row)])
    (scan,) = loaded.scans.values()
    assert (scan.brdf[0, 0], scan.sigma[0, 0]) == (1.5, 0.1)
    assert loaded.notes["foil"] == ("commas in numbers are taken for decimal points",)


def test_a_quoted_cell_may_hold_separators_and_line_ends(tmp_path):
    rows = [
        '"foil, one\nof two",550,30,20,180,1.5,0.1,',
        "tile,550,30,20,180,0.5,,",
        '"5"" foil",550,30,20,180,1,,',
    ]
    loaded = load([write(tmp_path, HEADER, *rows)])
    assert [scan.sample for scan in loaded.scans.values()] == ['5" foil', "foil, one of two", "tile"]
    assert load([write(tmp_path, HEADER, 'foil 5",550,30,20,180,1.5,,')]).scans["foil_5"].sample == 'foil 5"'


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (
            [HEADER, ROW, '"foil' + ROW[4:], ROW],
            r"csv, line 3: a quote does not close; close or remove it",
        ),
        ([HEADER, ROW, "x" * 131_073 + ROW[4:]], r"data\.csv, line 3: a cell of more than 131072 characters"),
        ([HEADER.replace("sample", "s" * 131_073), ROW], r"data\.csv, line 1: not CSV"),
        ([HEADER, ROW.replace("foil", "fo\0il")], r"data\.csv: not a text file \(byte \d+ is 0\)"),
        (
            [HEADER, ROW.replace(".", ",")],
            "10 cells.*columns; if commas stand for decimal points",
        ),
        (
            [HEADER.replace(",", ";"), ROW.replace(",", ";"), ROW.replace(",", ";").replace(".", ",")],
            "line 2, column fr_per_sr: '1.5' has a point, and other numbers of the column have a comma",
        ),
        ([HEADER.replace("_nm", "_" + "n" * 5000), ROW], "column 'wavelength_nnn"),
    ],
)
def test_csv_that_no_reader_takes(tmp_path, lines, message):
    with pytest.raises(InputError, match=message) as error:
        load_one([write(tmp_path, *lines)])
    assert len(str(error.value)) < 500


def test_columns_may_be_called_otherwise(tmp_path):
    path = write(
        tmp_path, "Angle in;Angle out;turn;lambda [nm];value", "30;20;180;550;1,5", "30;25;180;550;1,6"
    )
    names = {
        "Angle in": "theta_i_deg",
        "angle  out": "theta_r_deg",
        "turn": "dphi_deg",
        "lambda [nm]": "wavelength_nm",
        "value": "fr_per_sr",
    }
    (scan,) = load([path], names=names).scans.values()
    assert scan.brdf.tolist() == [[1.5], [1.6]]
    for wrong, said in (
        ({"Angel": "theta_i_deg"}, "column 'Angel' is not there; the columns are Angle in, Angle out"),
        ({"value": "albedo"}, "'albedo' is no name of a column; there are theta_i"),
        ({"Angle in": "theta_i_deg"}, "no column for .*theta_r"),
    ):
        with pytest.raises(InputError, match=said):
            load([path], names=wrong)
    with pytest.raises(InputError, match="--map is for columns of a table, and merl has none"):
        load([path], names=names, format_name="merl")
    wide = write(tmp_path, "# BRDF", "in,out,turn,550nm,650nm", "30,20,180,1.5,1.6")
    names = {"in": "theta_i_deg", "out": "theta_r_deg", "turn": "dphi_deg"}
    (scan,) = load([wide], names=names).scans.values()
    assert scan.brdf.tolist() == [[1.5, 1.6]]


def test_missing_and_binary_files(tmp_path):
    with pytest.raises(InputError, match=r"none\.csv: no such file"):
        load_one([tmp_path / "none.csv"])
    (tmp_path / "binary.csv").write_bytes(b"\x89HDF\r\n\x1a\n\x00\x00")
    with pytest.raises(InputError, match=r"binary\.csv: an HDF5 file; scans and fits of clbrdf"):
        load_one([tmp_path / "binary.csv"])
    (tmp_path / "other.csv").write_bytes(b"\x7fELF\x02\x01\x01\x00\x00\xff\xfe\x00")
    with pytest.raises(InputError, match=r"other\.csv: not a text file"):
        load_one([tmp_path / "other.csv"])


def test_the_real_coatings(coatings):
    scan = load_one([coatings / "black_coatings_in_plane.csv"], "z307_on_al")
    assert scan.brdf.shape == (114, 4)
    assert scan.repeated_directions() == 1  # the drift check at the start and at the end
    assert scan.flag_counts()["near_retro_possible_shading"] == 24
    hemisphere = load_one([coatings / "black_coatings_hemisphere_650nm.csv"], "AnoBlackEC1onAlum")
    assert hemisphere.brdf.shape == (1144, 1)
    assert not hemisphere.mask.any()
