"""The scan: what it masks, what it refuses, and its file."""

from __future__ import annotations

from dataclasses import replace

import h5py
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from clbrdf import InputError, Scan
from clbrdf.scan.flags import FLAGS
from clbrdf.storage import seal

ARRAYS = ("theta_i", "phi_i", "theta_r", "phi_r", "wavelength", "brdf", "sigma", "flags")
any_value = st.one_of(
    st.floats(allow_nan=True, allow_infinity=True), st.sampled_from([0.0, -0.0, -1.0, np.nan, np.inf])
)
printable = st.text(
    st.characters(codec="utf-8", exclude_characters="\0", exclude_categories=["Cs"]), max_size=20
)


@st.composite
def scans(draw):
    n, w = draw(st.integers(1, 5)), draw(st.integers(1, 4))

    def column(elements):
        return draw(arrays(np.float64, n, elements=elements))

    zenith, azimuth = st.floats(0.0, 89.999), st.floats(-720.0, 720.0)
    names = draw(st.lists(st.text("abc_xyz", min_size=1), unique=True, max_size=3))
    return Scan(
        column(zenith),
        column(azimuth),
        column(zenith),
        column(azimuth),
        np.sort(draw(arrays(np.float64, w, elements=st.floats(100.0, 3000.0), unique=True))),
        draw(arrays(np.float64, (n, w), elements=any_value)),
        sigma=draw(st.none() | arrays(np.float64, (n, w), elements=st.floats(0.0, 10.0) | st.just(np.nan))),
        flags=draw(arrays(np.uint32, (n, w), elements=st.integers(0, 2 ** (5 + len(names)) - 1))),
        flag_names=(*FLAGS, *names),
        sample=draw(printable),
        instrument=draw(printable),
        provenance=draw(st.dictionaries(st.text("abc_", min_size=1), printable, max_size=3)),
    )


def assert_same(ours: Scan, theirs: Scan) -> None:
    for name in ARRAYS:
        a, b = getattr(ours, name), getattr(theirs, name)
        assert (a is None) == (b is None)
        if a is not None:
            assert a.dtype == b.dtype
            assert a.tobytes() == b.tobytes()
    for name in ("sample", "instrument", "flag_names", "provenance"):
        assert getattr(ours, name) == getattr(theirs, name)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(scan=scans())
def test_file_round_trip_is_exact(scan, tmp_path):
    scan.save(tmp_path / "scan.h5", overwrite=True)
    assert_same(scan, Scan.open(tmp_path / "scan.h5"))


@given(scan=scans())
def test_unmasked_values_are_finite_and_positive_or_allowed_by_their_uncertainty(scan):
    usable = ~scan.mask
    good = np.isfinite(scan.brdf) & (scan.brdf > 0.0)
    if scan.sigma is not None:
        with np.errstate(invalid="ignore"):
            good |= (np.abs(scan.brdf) <= 5.0 * scan.sigma) & (scan.sigma > 0.0)
    assert good[usable].all()
    assert scan.mask[~good].all()


def test_unusable_values_are_kept_counted_and_named():
    values = np.array([[1.0, np.nan, np.inf, 0.0, -2.0, -np.inf]])
    scan = Scan([10.0], 0.0, [20.0], 180.0, np.arange(6.0) + 400.0, values)
    assert scan.mask.tolist() == [[False, True, True, True, True, True]]
    assert scan.flag_counts() == {"not_a_number": 1, "infinite": 2, "zero": 1, "negative": 1}
    np.testing.assert_array_equal(scan.brdf, values)


def test_azimuth_is_the_view_azimuth_from_the_incident_one(small_scan):
    turned = replace(small_scan, phi_i=small_scan.phi_i + 350.0, phi_r=small_scan.phi_r + 350.0)
    assert turned.phi.tolist() == small_scan.phi.tolist()


def test_records_do_not_change(small_scan):
    for name in ARRAYS:
        with pytest.raises(ValueError, match="read-only"):
            getattr(small_scan, name)[...] = 0
    with pytest.raises(TypeError):
        small_scan.provenance["x"] = "y"


def test_a_record_does_not_share_memory_with_what_it_was_made_of():
    values = np.ones((1, 1))
    scan = Scan([10.0], 0.0, [20.0], 180.0, [500.0], values)
    values[0, 0] = 7.0
    assert scan.brdf[0, 0] == 1.0


def test_choosing_wavelengths(small_scan):
    chosen = small_scan.at([440.0, 700.0])
    assert chosen.wavelength.tolist() == [450.0, 650.0]
    assert (chosen.brdf == small_scan.brdf[:, [0, 2]]).all()
    assert (chosen.sigma == small_scan.sigma[:, [0, 2]]).all()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"theta_i": np.array([30.0, 90.0])}, r"theta_i\[1\] is 90°"),
        ({"theta_r": np.array([-1.0, 0.0])}, r"theta_r\[0\] is -1°"),
        ({"phi_i": np.array([np.nan])}, r"phi_i\[0\] is nan"),
        ({"wavelength": [600.0, 500.0]}, r"wavelength\[1\], 500 nm, follows 600 nm; sort"),
        ({"wavelength": [600.0, 600.0]}, r"wavelength\[1\], 600 nm, repeats 600 nm"),
        ({"wavelength": [-1.0, 500.0]}, r"wavelength\[0\] is -1 nm; it has to be positive"),
        ({"wavelength": [500.0, np.nan]}, r"wavelength\[1\] is nan"),
        ({"wavelength": [[500.0, 600.0]]}, "wavelength has 2 dimensions"),
        ({"brdf": np.ones((2, 3))}, r"brdf has shape \(2, 3\); 2 directions × 2 wavelengths need \(2, 2\)"),
        ({"sigma": -np.ones((2, 2))}, r"sigma\[0, 0\] is -1"),
        ({"sigma": np.full((2, 2), np.inf)}, r"sigma\[0, 0\] is inf"),
        ({"flag_names": ("other",)}, "flag names"),
        ({"wavelength": [], "brdf": np.ones((2, 0))}, "2 directions and 0 wavelengths holds nothing"),
    ],
)
def test_impossible_scans_are_refused(change, message):
    good = {
        "theta_i": np.array([30.0, 45.0]),
        "phi_i": np.zeros(1),
        "theta_r": np.array([10.0, 20.0]),
        "phi_r": np.full(1, 180.0),
        "wavelength": [500.0, 600.0],
        "brdf": np.ones((2, 2)),
    }
    with pytest.raises(InputError, match=message):
        Scan(**{**good, **change})


class TestFile:
    """What is wrong with a file is said in one line that names it."""

    @pytest.fixture
    def path(self, small_scan, tmp_path):
        small_scan.save(tmp_path / "scan.h5")
        return tmp_path / "scan.h5"

    def test_viewers_find_the_data_with_units(self, path):
        with h5py.File(path) as file:
            entry = file[file.attrs["default"]]
            data = entry[entry.attrs["default"]]
            assert (entry.attrs["NX_class"], data.attrs["NX_class"]) == ("NXentry", "NXdata")
            assert data.attrs["signal"] == "brdf"
            assert list(data.attrs["axes"]) == [".", "wavelength"]
            assert entry["definition"].asstr()[()] == "NXoptical_spectroscopy"
            units = {name: data[name].attrs["units"] for name in data}
        assert units == {
            **dict.fromkeys(("theta_i", "theta_r", "phi_i", "phi_r"), "deg"),
            "wavelength": "nm",
            **dict.fromkeys(("brdf", "brdf_errors"), "1/sr"),
            "flags": "",
        }

    def test_missing(self, tmp_path):
        with pytest.raises(InputError, match=r"nothing\.h5: no such file"):
            Scan.open(tmp_path / "nothing.h5")

    def test_folder(self, tmp_path):
        with pytest.raises(InputError, match="is a folder"):
            Scan.open(tmp_path)

    def test_not_hdf5(self, tmp_path):
        (tmp_path / "text.h5").write_text("theta_i_deg,fr_per_sr\n")
        with pytest.raises(
            InputError, match=r"text\.h5: not an HDF5 file; bring measured text in with 'clbrdf import'"
        ):
            Scan.open(tmp_path / "text.h5")

    def test_every_truncation_is_an_error_and_never_a_wrong_scan(self, path, tmp_path):
        whole = path.read_bytes()[: -seal.LENGTH]  # what HDF5 knows of
        for share in (0.02, 0.3, 0.6, 0.9, 0.999):
            short = tmp_path / "short.h5"
            short.write_bytes(whole[: int(len(whole) * share)])
            with pytest.raises(InputError, match=r"short\.h5: (truncated|damaged|not an HDF5)"):
                Scan.open(short)

    def test_foreign_hdf5(self, tmp_path):
        with h5py.File(tmp_path / "foreign.h5", "w") as file:
            file["data"] = [1.0]
        with pytest.raises(InputError, match=r"foreign\.h5: not a file of clbrdf"):
            Scan.open(tmp_path / "foreign.h5")

    @pytest.mark.parametrize(
        ("version", "message"),
        [(3, "format version 3, newer than the 2"), (0, "version 0"), ("1", "not a whole")],
    )
    def test_wrong_version(self, path, version, message):
        with h5py.File(path, "a") as file:
            file.attrs["clbrdf_format"] = version
        with pytest.raises(InputError, match=message):
            Scan.open(path)

    @pytest.mark.parametrize("name", ["data/brdf", "data/theta_i", "data/flags", "sample", "data"])
    def test_incomplete(self, path, name):
        with h5py.File(path, "a") as file:
            del file["entry"][name]
        with pytest.raises(InputError, match=r"scan\.h5: .*; the file is incomplete"):
            Scan.open(path)

    def test_damaged_content_names_the_file(self, path):
        with h5py.File(path, "a") as file:
            file["entry/data/wavelength"][...] = [450.0, 440.0, 650.0]
        with pytest.raises(InputError, match=r"scan\.h5: wavelength\[1\], 440 nm, follows 450 nm"):
            Scan.open(path)

    def test_existing_output_is_kept(self, path, small_scan):
        before = path.read_bytes()
        with pytest.raises(InputError, match=r"scan\.h5: exists already"):
            small_scan.save(path)
        assert path.read_bytes() == before
        replace(small_scan, sample="other").save(path, overwrite=True)
        assert Scan.open(path).sample == "other"

    def test_output_folder_missing(self, small_scan, tmp_path):
        with pytest.raises(InputError, match="does not exist; create it first"):
            small_scan.save(tmp_path / "no" / "scan.h5")

    def test_the_same_scan_gives_the_same_bytes(self, path, small_scan, tmp_path):
        small_scan.save(tmp_path / "again.h5")
        assert (tmp_path / "again.h5").read_bytes() == path.read_bytes()
