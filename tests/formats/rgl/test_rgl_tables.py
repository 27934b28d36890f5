"""What a file has to hold, and what is said where it does not."""

from __future__ import annotations

import numpy as np
import pytest

from clbrdf import InputError
from clbrdf.formats.rgl.export import export_material
from clbrdf.formats.rgl.tables import read_tables, size_of, to_fields, write_tables
from clbrdf.formats.rgl.tensor_file import write_tensor_file
from clbrdf.formats.rgl.values import TensorReader
from tests.formats.rgl.materials import coloured, lambert, spectral


@pytest.fixture(scope="module")
def tables():
    return export_material(spectral(lambert(0.5)), 0.02).tables


@pytest.fixture(scope="module")
def rgb_tables():
    return export_material(coloured(lambert(0.5)), 0.02).tables


def test_round_trip(tmp_path, tables, rgb_tables):
    for each in (tables, rgb_tables):
        path = tmp_path / f"{each.bands}{each.wavelength is None}.bsdf"
        write_tables(path, each)
        back = read_tables(path)
        for name, array in to_fields(each).items():
            np.testing.assert_array_equal(to_fields(back)[name], array)
        assert 0 < path.stat().st_size - size_of(each) < 600
        with pytest.raises(InputError, match="exists already"):
            write_tables(path, each)


def drop(name):
    return lambda fields: fields.pop(name)


def put(name, change):
    def apply(fields):
        fields[name] = change(fields[name].copy())

    return apply


def assign(value, *index):
    def apply(array):
        array[index] = value
        return array

    return apply


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (drop("vndf"), "has no field 'vndf'"),
        (drop("wavelengths"), "has no field 'wavelengths'"),
        (drop("spectra"), "has no field 'rgb'"),
        (put("theta_i", lambda a: a.astype(np.float64)), "field 'theta_i' is of type float64"),
        (put("theta_i", lambda a: a[::-1]), "field 'theta_i' does not increase"),
        (put("theta_i", lambda a: a + 1.0), "leaves 0 to π/2 radians"),
        (put("theta_i", lambda a: a[:-1]), "phi_i and theta_i have 1 and"),
        (put("phi_i", assign(np.nan, 0)), "field 'phi_i' holds values that are not finite"),
        (put("sigma", assign(0.0, 0, 3)), "not positive"),
        (put("ndf", assign(-1.0, 0, 3)), "not positive"),
        (put("ndf", lambda a: a[0]), "field 'ndf' has the shape"),
        (put("vndf", assign(-1.0, 0, 0, 0, 0)), "field 'vndf' holds negative"),
        (put("vndf", lambda a: a[..., :1]), "two nodes an axis"),
        (put("luminance", lambda a: a[..., :-1]), "no square grid in common"),
        (put("spectra", lambda a: a[:, :, :2]), "2 spectra do not agree"),
        (put("wavelengths", lambda a: a[::-1]), "'wavelengths' does not increase"),
        (put("wavelengths", assign(-5.0, 0)), "'wavelengths' does not increase from above 0"),
        (put("description", lambda a: np.full(3, np.nan)), "field 'description' is of type float64"),
        (lambda fields: fields.update({"a\nb": fields.pop("ndf")}), r"it holds .*'a\\nb'"),
        (put("jacobian", lambda a: np.zeros(2, np.uint8)), "field 'jacobian' has 2 values"),
    ],
)
def test_bad_fields_are_named(tmp_path, tables, spoil, message):
    fields = dict(to_fields(tables))
    spoil(fields)
    path = tmp_path / "bad.bsdf"
    write_tensor_file(path, fields)
    with pytest.raises(InputError, match=message) as told:
        read_tables(path)
    assert str(told.value).startswith(f"{path}: ")


def test_two_bands_are_no_rgb(tmp_path, rgb_tables):
    fields = dict(to_fields(rgb_tables))
    fields["rgb"] = fields["rgb"][:, :, :2]
    write_tensor_file(tmp_path / "bad.bsdf", fields)
    with pytest.raises(InputError, match="field 'rgb' has 2 bands"):
        read_tables(tmp_path / "bad.bsdf")


def test_the_part_of_a_turn_has_to_be_one(tmp_path, tables):
    fields = dict(to_fields(tables))
    fields["phi_i"] = np.linspace(0, 2, 3, dtype=np.float32)
    for name in ("vndf", "luminance", "spectra"):
        fields[name] = np.repeat(fields[name], 3, axis=0)
    write_tensor_file(tmp_path / "bad.bsdf", fields)
    with pytest.raises(InputError, match="field 'phi_i' spans 115°"):
        read_tables(tmp_path / "bad.bsdf")


def test_angles_out_of_range(tables):
    reader = TensorReader(tables)
    with pytest.raises(InputError, match=r"theta_r\[0\] is 90°"):
        reader.brdf(10.0, 90.0, 0.0)
    with pytest.raises(InputError, match="do not belong together"):
        reader.brdf([10.0, 20.0], [1.0, 2.0, 3.0], 0.0)


def test_blocks_give_the_same(tables, monkeypatch):
    angles = [np.linspace(1.0, top, 50) for top in (80.0, 85.0, 350.0)]
    whole = TensorReader(tables).brdf(*angles)
    monkeypatch.setattr("clbrdf.formats.rgl.values.BLOCK", 21)
    np.testing.assert_array_equal(TensorReader(tables).brdf(*angles), whole)
