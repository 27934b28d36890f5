"""Every format against files written by hand: what is in them comes out, in our conventions."""

from __future__ import annotations

import math

import numpy as np
import pytest

from clbrdf import InputError
from clbrdf.formats.load import load, load_one
from clbrdf.formats.registry import find_format, formats
from tests.formats import made_files as made
from tests.formats.made_files import RHO, F


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


def test_reflectance_factors_are_pi_f(text):
    scan = load_one([text(made.factors())])
    assert scan.brdf == pytest.approx(F)
    assert scan.wavelength.tolist() == [600.0, 900.0]
    assert scan.bandpass.tolist() == [10.0, 12.0]


def test_wide_tables_with_text_above(text):
    scan = load_one([text(made.wide())])
    assert scan.wavelength.tolist() == [450.5, 650.0]
    assert scan.brdf == pytest.approx(np.tile([F, F / 2], (18, 1)))


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
        (made.long_csv().replace("\nfoil", '\n"foil', 1).encode(), "a quote does not close"),
        (made.bird(uBRDF=("1/sr", [math.inf] * 18)).encode(), r"bad\.csv: sigma\[0, 0\] is inf"),
        (b"hello world\n", "no data; the first line names the columns"),
        (SEMICOLONS.replace("0.01", "0;01").encode(), "9 cells, and the first line names 8"),
        (SEMICOLONS.replace("0.01", "0,01", 1).encode(), "'0.01' has a point, and other numbers of"),
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
