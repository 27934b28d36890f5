"""Four angles, two sides, several scans in a file, and what joins them."""

from __future__ import annotations

from dataclasses import replace

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import clbrdf
from clbrdf import Directions, InputError, Scan
from clbrdf.scan import open_scans, save_scans
from clbrdf.scan.flags import FLAGS, translated

azimuth = st.floats(0.0, 359.999)
view = st.floats(0.0, 180.0).filter(lambda angle: angle != 90.0)


@given(theta_i=st.floats(0.0, 89.9), phi_i=azimuth, theta_r=view, phi_r=azimuth)
def test_directions_keep_all_four_angles_and_know_their_side(theta_i, phi_i, theta_r, phi_r):
    one = Directions(theta_i, phi_i, theta_r, phi_r)
    assert (one.theta_i[0], one.phi_i[0], one.theta_r[0], one.phi_r[0]) == (theta_i, phi_i, theta_r, phi_r)
    turn = one.phi[0] - (phi_r - phi_i)
    assert 0.0 <= one.phi[0] < 360.0
    assert turn == pytest.approx(360.0 * round(turn / 360.0), abs=1e-12)
    assert one.side[0] == ("reflection" if theta_r < 90.0 else "transmission")


@pytest.mark.parametrize(
    ("theta_r", "message"),
    [
        (90.0, r"theta_r\[0\] is 90°; .* in \(90°, 180°\] for tr"),
        (180.1, "180.1"),
        (-1.0, "-1"),
    ],
)
def test_a_view_at_the_horizon_or_beyond_is_refused(theta_r, message):
    with pytest.raises(InputError, match=message):
        Directions(10.0, 0.0, theta_r, 0.0)


def two_sides() -> Scan:
    theta_r = np.array([10.0, 40.0, 140.0, 170.0])
    return Scan([30.0], [0.0], theta_r, [180.0], [500.0, 600.0], np.arange(1.0, 9.0).reshape(4, 2))


def test_a_model_of_reflection_refuses_transmission_and_counts_it():
    with pytest.raises(InputError, match=r"1 of 2 directions are of transmission"):
        clbrdf.evaluate({}, 30.0, [20.0, 120.0], 180.0)
    with pytest.raises(InputError, match=r"1 of 2 directions are of transmission"):
        clbrdf.evaluate({}, 30.0, [20.0, 120.0], 180.0, precision="reference")


def test_a_fit_takes_reflection_only_and_says_how_many_others_there_were(small_scan):
    beyond = small_scan.rows([3, 40])
    beyond = replace(beyond, theta_r=180.0 - beyond.theta_r, brdf=7.0 * beyond.brdf)
    alone = clbrdf.fit(small_scan)
    both = clbrdf.fit(Scan.merge([beyond, small_scan]), weights="none")
    assert both.provenance["left_out"] == "2 directions, those of transmission"
    assert "left_out" not in alone.provenance
    np.testing.assert_array_equal(both.vector, alone.vector)
    assert len(both.scan) == 48
    weighted = clbrdf.fit(Scan.merge([beyond, small_scan]), weights=np.linspace(1.0, 2.0, 50))
    np.testing.assert_array_equal(weighted.setup.weights[:, 0], np.linspace(1.0, 2.0, 50)[2:])


def test_a_fit_of_transmission_alone_is_refused():
    with pytest.raises(InputError, match="all 2 directions are of transmission"):
        clbrdf.fit(two_sides().rows([2, 3]))


def test_rows_and_columns_take_parts():
    scan = replace(two_sides(), solid_angle=[1e-3, 2e-3, 3e-3, np.nan], bandpass=[2.0, 3.0])
    part = scan.rows(scan.transmitted).columns([1])
    assert part.theta_r.tolist() == [140.0, 170.0]
    assert part.brdf.tolist() == [[6.0], [8.0]]
    np.testing.assert_array_equal(part.solid_angle, [3e-3, np.nan])
    assert part.bandpass.tolist() == [3.0]
    assert part.side.tolist() == ["transmission", "transmission"]


def test_directions_that_differ_in_the_incident_azimuth_only_are_no_repeats():
    scan = Scan([30.0] * 3, [0.0, 45.0, 45.0], [20.0] * 3, [180.0, 225.0, 225.0], [500.0], np.ones((3, 1)))
    assert scan.phi.tolist() == [180.0] * 3
    assert scan.repeated_directions() == 1
    assert scan.rotations().tolist() == [0.0, 45.0]
    assert two_sides().rotations().tolist() == []


class TestMerge:
    def test_other_directions_come_after(self):
        scan = two_sides()
        both = Scan.merge([scan.rows([0, 1]), scan.rows([2, 3])])
        assert both.theta_r.tolist() == scan.theta_r.tolist()
        np.testing.assert_array_equal(both.brdf, scan.brdf)

    def test_other_wavelengths_fill_the_same_directions(self):
        scan = replace(two_sides(), sigma=np.full((4, 2), 0.1))
        both = Scan.merge([scan.columns([1]), scan.columns([0]).rows([3, 2, 0])])
        assert both.wavelength.tolist() == [500.0, 600.0]
        assert both.theta_r.tolist() == scan.theta_r.tolist()
        np.testing.assert_array_equal(both.brdf, [[1, 2], [np.nan, 4], [5, 6], [7, 8]])
        assert both.flag_counts() == {"not_measured": 1}
        assert both.mask.tolist() == [[False] * 2, [True, False], [False] * 2, [False] * 2]

    def test_what_is_measured_again_is_a_repeat(self):
        scan = two_sides()
        both = Scan.merge([scan, scan.columns([1])])
        assert len(both) == 8
        assert both.repeated_directions() == 4
        np.testing.assert_array_equal(both.brdf[4:, 1], scan.brdf[:, 1])

    def test_flags_keep_their_names_and_unmeasured_rows_stay(self):
        shape = (4, 2)
        first = replace(two_sides(), flags=np.full(shape, 32), flag_names=(*FLAGS, "shaded"))
        second = replace(two_sides(), flags=np.full(shape, 32), flag_names=(*FLAGS, "saturated"))
        missing = replace(two_sides(), brdf=np.full(shape, np.nan), flags=np.ones(shape))
        both = Scan.merge([first.columns([0]), second.columns([1]), missing.rows([0]).columns([1])])
        assert both.flag_counts() == {"not_measured": 2, "shaded": 4, "saturated": 4}
        assert len(both) == 5

    @pytest.mark.parametrize(
        ("change", "message"),
        [
            ({"source_polarisation": "s"}, r"different source_polarisation \(s, unknown\)"),
            ({"wavelength": [np.nan] * 2, "bands": ("R", "G")}, "bands and scans of wavelengths"),
        ],
    )
    def test_what_does_not_belong_together_is_refused(self, change, message):
        with pytest.raises(InputError, match=message):
            Scan.merge([two_sides(), replace(two_sides(), **change)])

    @given(st.permutations(range(8)), st.integers(1, 7))
    def test_any_two_parts_make_the_whole(self, order, cut):
        whole = two_sides()
        flags = whole.flags.copy()
        flags.flat[order[cut:]] |= 1
        other = whole.flags.copy()
        other.flat[order[:cut]] |= 1
        parts = [replace(whole, flags=flags), replace(whole, flags=other)]
        # Columns in two parts go by cells; of equal columns nothing fills up.
        both = Scan.merge([part.columns([k]) for part in parts for k in (0, 1)])
        measured = ~both.mask
        assert measured.sum() == 8
        got = sorted(zip(both.theta_r[np.nonzero(measured)[0]], both.brdf[measured], strict=True))
        assert got == sorted(zip(np.repeat(whole.theta_r, 2), whole.brdf.ravel(), strict=True))


def test_bits_move_to_their_new_names():
    flags = np.array([[1, 32, 64 | 2]], np.uint32)
    moved = translated(flags, (*FLAGS, "a", "b"), (*FLAGS, "b", "c", "a"))
    assert moved.tolist() == [[1, 128, 32 | 2]]


class TestSeveralInOneFile:
    @pytest.fixture
    def path(self, tmp_path):
        one = replace(two_sides(), sample="one", source_polarisation="s", detector_polarisation="p")
        two = Scan(
            [10.0], [5.0], [20.0], [185.0], [np.nan] * 3, [[1.0, 2.0, 3.0]], bands=("R", "G", "B"),
            solid_angle=1e-3, sample="two",
        )  # fmt: skip
        save_scans(tmp_path / "both.h5", {"one": one, "two": two})
        return tmp_path / "both.h5"

    def test_each_is_found_by_name(self, path):
        one, two = Scan.open(f"{path}::one"), Scan.open(f"{path}::two")
        assert (one.sample, one.source_polarisation, one.detector_polarisation) == ("one", "s", "p")
        assert one.side.tolist() == ["reflection"] * 2 + ["transmission"] * 2
        assert (two.bands, two.labels, two.solid_angle.tolist()) == (("R", "G", "B"), ("R", "G", "B"), [1e-3])
        assert np.isnan(two.wavelength).all()
        assert (two.phi_i[0], two.phi_r[0]) == (5.0, 185.0)
        assert list(open_scans(path)) == ["one", "two"]
        assert list(open_scans(f"{path}::two")) == ["two"]

    def test_bands_are_not_called_wavelengths_in_the_file(self, path):
        with h5py.File(path) as file:
            assert "wavelength" not in file["two/data"]
            assert file["two/data"].attrs["bands"].tolist() == ["R", "G", "B"]
            assert "solid_angle" not in file["one/data"]
            assert file["two/data/solid_angle"].attrs["units"] == "sr"

    def test_a_missing_or_unknown_name_is_told_with_those_there_are(self, path):
        with pytest.raises(InputError, match=r"2 scans; name one of them, as in both\.h5::one: one, two"):
            Scan.open(path)
        with pytest.raises(InputError, match=r"no entry is called 'three'; there are one, two"):
            Scan.open(f"{path}::three")

    def test_a_name_that_a_command_could_not_take_is_refused(self, tmp_path):
        with pytest.raises(InputError, match="is no name for a scan"):
            save_scans(tmp_path / "x.h5", {"a/b": two_sides()})

    def test_a_file_may_have_the_mark_in_its_own_name(self, tmp_path):
        two_sides().save(tmp_path / "a::b.h5")
        assert len(Scan.open(tmp_path / "a::b.h5")) == 4


class TestUnitsInAFile:
    @pytest.fixture
    def path(self, tmp_path):
        two_sides().save(tmp_path / "scan.h5")
        return tmp_path / "scan.h5"

    def change(self, path, name, factor, units):
        with h5py.File(path, "a") as file:
            dataset = file["entry/data"][name]
            dataset[...] = dataset[()] * factor
            if units is None:
                del dataset.attrs["units"]
            else:
                dataset.attrs["units"] = units

    @pytest.mark.parametrize(
        ("name", "factor", "units"),
        [
            ("theta_r", np.pi / 180.0, "rad"),
            ("theta_r", 1.0, "°"),
            ("wavelength", 1e-3, "um"),
            ("wavelength", 1e-3, "µm"),
            ("wavelength", 10.0, "Angstrom"),
            ("brdf", 1.0, "sr^-1"),
        ],
    )
    def test_known_units_are_converted(self, path, name, factor, units):
        self.change(path, name, factor, units)
        np.testing.assert_allclose(getattr(Scan.open(path), name), getattr(two_sides(), name), rtol=1e-14)

    @pytest.mark.parametrize(
        ("name", "units", "message"),
        [
            ("theta_r", "gon", r"/entry/data/theta_r: unit 'gon' is not known; known are deg"),
            ("brdf", "percent", r"/entry/data/brdf: unit 'percent' is not known"),
            ("wavelength", None, r"/entry/data/wavelength: the unit is missing; known are nm"),
            ("wavelength", 5, r"/entry/data/wavelength: the unit is missing"),
        ],
    )
    def test_other_units_are_refused(self, path, name, units, message):
        self.change(path, name, 1.0, units)
        with pytest.raises(InputError, match=message):
            Scan.open(path)


class TestDamagedFile:
    @pytest.fixture
    def path(self, tmp_path):
        two_sides().save(tmp_path / "scan.h5")
        return tmp_path / "scan.h5"

    @pytest.mark.parametrize(
        ("name", "make", "message"),
        [
            ("data/brdf", {"shape": (10**6, 10**6), "dtype": "f8", "chunks": (100, 100)}, "needs? |need "),
            (
                "data/theta_i",
                {"shape": (10**12,), "dtype": "f8", "chunks": (100,)},
                "claims 8000000000000 b",
            ),
            ("data/theta_i", {"data": ["a"] * 4}, "holds object, and numbers are needed"),
            ("data/theta_i", {"data": 3.0}, "has 0 dimensions and needs 1"),
            ("data/flags", {"data": np.ones((4, 2))}, "holds float64"),
            (
                "data/flags",
                {"data": np.ones((2, 4), "u4")},
                r"\(2, 4\), and the other arrays need \(4, 2\)",
            ),
            ("sample/name", {"data": 3.0}, "is no text"),
        ],
    )
    def test_what_is_claimed_is_looked_at_before_it_is_read(self, path, name, make, message):
        with h5py.File(path, "a") as file:
            attributes = dict(file["entry"][name].attrs)
            del file["entry"][name]
            file["entry"].create_dataset(name, **make).attrs.update(attributes)
        with pytest.raises(InputError, match=rf"scan\.h5: .*{message}"):
            Scan.open(path)

    def test_a_group_in_the_place_of_an_array(self, path):
        with h5py.File(path, "a") as file:
            del file["entry/data/brdf"]
            file["entry/data"].create_group("brdf")
        with pytest.raises(InputError, match="/entry/data/brdf is no array"):
            Scan.open(path)

    def test_a_file_of_version_1_opens(self, path):
        scan = two_sides()
        values = scan.brdf.copy()
        values[0, 0] = -0.1
        replace(scan, brdf=values, sigma=np.full((4, 2), 0.1)).save(path, overwrite=True)
        with h5py.File(path, "a") as file:
            file.attrs["clbrdf_format"] = 1
            # Version 1 flagged every negative value.
            file["entry/data/flags"][0, 0] = 1 << FLAGS.index("negative")
        assert not Scan.open(path).mask.any()
