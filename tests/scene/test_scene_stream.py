"""Scenes into files: the same values as in memory, in bounded memory, whole or not at all."""

from __future__ import annotations

import subprocess
import sys
import textwrap

import h5py
import numpy as np
import pytest

from clbrdf import InputError, Scan
from clbrdf.scene import simulate
from clbrdf.scene.simulate import set_up
from clbrdf.scene.stream import STREAM_VALUES, stream
from tests.scene.scenes import scene

SMALL = {"theta_i": [30, 60], "theta_r": [0, 30, 60], "wavelength": {"start": 400, "stop": 700, "step": 10}}
HEMISPHERE = {
    "theta_i": 45,
    "theta_r": {"start": 0, "stop": 89, "step": 1},
    "phi_r": {"start": 0, "stop": 359, "step": 1},
    "wavelength": {"start": 380, "stop": 760, "step": 1},
    "surface": {"parameters": {"c": {"polynomial": [-300, 10], "centre": 570, "scale": 190}}},
}


@pytest.mark.parametrize("values", [50, 100, STREAM_VALUES])
@pytest.mark.parametrize("effects", [{}, {"reader": True, "saturation": True}])
def test_the_file_holds_what_memory_holds(tmp_path, effects, values, monkeypatch):
    monkeypatch.setattr("clbrdf.scene.stream.STREAM_VALUES", values)
    made = scene(**SMALL, effects=effects, detector={"integration_time": 0.05}, sample="foil", seed=3)
    stream(set_up(made), tmp_path / "scan.h5", text="the scene", provenance={"seed": "3"})
    kept, there = Scan.open(tmp_path / "scan.h5"), simulate(made)
    for name in ("theta_i", "theta_r", "phi", "wavelength", "brdf", "flags"):
        np.testing.assert_array_equal(getattr(kept, name), getattr(there, name))
    assert (kept.sigma is None) == (there.sigma is None)
    if kept.sigma is not None:
        np.testing.assert_array_equal(kept.sigma, there.sigma)
        assert kept.mask.any()
    assert (kept.sample, kept.flag_names, kept.instrument) == (
        there.sample,
        there.flag_names,
        there.instrument,
    )
    with h5py.File(tmp_path / "scan.h5") as file:
        assert file["entry/scene"].asstr()[()] == "the scene"


def test_single_precision_is_stored_as_it_is(tmp_path):
    for precision, kind in (("single", np.float32), ("double", np.float64)):
        stream(set_up(scene(**SMALL, precision=precision)), tmp_path / f"{precision}.h5")
        with h5py.File(tmp_path / f"{precision}.h5") as file:
            assert file["entry/data/brdf"].dtype == kind
            assert file["entry/data/flags"].id.get_storage_size() == 0


def test_unusable_values_are_flagged(tmp_path, small_scan):
    flags = np.zeros(small_scan.brdf.shape, np.uint32)
    flags[20] = 1
    masked = Scan(
        small_scan.theta_i, small_scan.phi_i, small_scan.theta_r, small_scan.phi_r, small_scan.wavelength,
        small_scan.brdf, flags=flags,
    )  # fmt: skip
    masked.save(tmp_path / "measured.h5")
    made = scene(
        small_scan.theta_i[20], small_scan.theta_r[20], 550, surface={"file": str(tmp_path / "measured.h5")}
    )
    done = stream(set_up(made), tmp_path / "scan.h5")
    assert done.flagged == 1
    assert Scan.open(tmp_path / "scan.h5").flag_counts() == {"not_a_number": 1}


def test_same_scene_same_bytes(tmp_path):
    made = scene(**SMALL, effects={"shot_noise": True})
    for name in ("a.h5", "b.h5"):
        stream(set_up(made), tmp_path / name)
    assert (tmp_path / "a.h5").read_bytes() == (tmp_path / "b.h5").read_bytes()


def test_nothing_is_left_of_a_broken_run(tmp_path):
    def interrupted(done, total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        stream(set_up(scene(**SMALL)), tmp_path / "scan.h5", report=interrupted)
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "scan.h5").touch()
    with pytest.raises(InputError, match="exists already"):
        stream(set_up(scene(**SMALL)), tmp_path / "scan.h5")


@pytest.mark.parametrize("effects", [{}, {"shot_noise": {}, "reader": {}}], ids=["none", "noise"])
def test_12_million_values_in_a_gigabyte(tmp_path, effects):
    code = f"""
    from clbrdf.bench.memory import peak_memory
    from clbrdf.scene.simulate import set_up
    from clbrdf.scene.stream import STREAM_VALUES, stream
    from tests.scene.scenes import scene
    from tests.scene.test_scene_stream import HEMISPHERE
    done = stream(set_up(scene(**HEMISPHERE, precision="single", effects={effects!r})), "scan.h5")
    assert done.values == 32041 * 381
    print(peak_memory())
    """
    root = str(__file__).rsplit("/tests/", 1)[0]
    ended = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path.insert(0, {root!r})\n" + textwrap.dedent(code)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    )
    peak = int(ended.stdout)
    assert peak < 1 << 30, f"{peak / 2**20:.0f} MiB"
    with h5py.File(tmp_path / "scan.h5") as file:
        values = file["entry/data/brdf"]
        assert values.shape == (32041, 381)
        assert np.isfinite(values[[0, 20000, -1]]).all()


@pytest.mark.parametrize("each", ["value", "direction", "scan"])
def test_random_effects_are_components(tmp_path, each):
    effects = {"read_noise": {}, "reader": {"percent": 2.0, "each": each}}
    made = scene(**SMALL, effects=effects, detector={"integration_time": 0.05})
    scan = simulate(made)
    noise, reader = scan.components
    assert noise.is_noise
    assert reader.is_random == (each != "scan")
    assert reader.wavelength.form == ("random" if each == "value" else "systematic")
    # The reader's part is of the values before it: a percentage of a value that is 2 % off.
    assert scan.sigma == pytest.approx(np.hypot(noise.values, 0.02 * scan.brdf), rel=0.1)
    stream(set_up(made), tmp_path / "scan.h5")
    again = Scan.open(tmp_path / "scan.h5")
    assert [one.name for one in again.components] == ["noise", "reader"]
    assert np.asarray(again.components[0].values).tobytes() == np.asarray(noise.values).tobytes()
    assert again.components[1].wavelength.form == reader.wavelength.form
