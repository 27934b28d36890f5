"""Pictures and sweeps in files."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from PIL import Image

from clbrdf import InputError, Scan
from clbrdf.viz.panel import Entry
from clbrdf.viz.scene import Scene
from clbrdf.viz.stills import pixels, save_gif, save_mp4, save_png, sweep_stops
from clbrdf.viz.style import Look
from clbrdf.viz.subject import Subject

pytestmark = pytest.mark.usefixtures("gl")


@pytest.fixture
def scene(foil):
    made = Scene([Entry(foil, 550.0, 45.0)], Look(radius="log"), size=(400, 300))
    yield made
    made.close()


def test_png_has_the_size_and_the_background_asked_for(scene, tmp_path):
    save_png(scene, tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.size == (400, 300)
        np.testing.assert_array_equal(np.asarray(picture), pixels(scene))
    save_png(scene, tmp_path / "b.png", transparent=True)
    with Image.open(tmp_path / "b.png") as picture:
        assert picture.mode == "RGBA"
        assert picture.getpixel((399, 299))[3] == 0
    with pytest.raises(InputError, match="exists already"):
        save_png(scene, tmp_path / "a.png")


def test_gif_goes_there_and_back_with_one_scale(scene, tmp_path):
    told = []
    stops = save_gif(scene, tmp_path / "a.gif", "wavelength", report=lambda k, n: told.append((k, n)))
    assert stops == 3
    assert told == [(1, 3), (2, 3), (3, 3)]
    assert scene.held is not None
    # The longest value of all frames: 650 nm, 1.1 times Table 1 at 45°.
    assert scene.held.top == pytest.approx(1.1 * 657.6, rel=1e-3)
    with Image.open(tmp_path / "a.gif") as picture:
        assert picture.n_frames == 4
        first = np.asarray(picture.convert("RGB")).astype(int)
        picture.seek(2)
        assert np.abs(np.asarray(picture.convert("RGB")) - first).max() > 60


def test_mp4_is_a_film_of_as_many_frames(scene, tmp_path):
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
    assert save_mp4(scene, tmp_path / "a.mp4", "theta-i", frames=5) == 5
    assert imageio_ffmpeg.count_frames_and_secs(str(tmp_path / "a.mp4"))[0] == 5
    assert [p.name for p in tmp_path.iterdir()] == ["a.mp4"]


def test_sweeps(scene, foil):
    assert sweep_stops(scene, "wavelength") == [450.0, 550.0, 650.0]
    assert sweep_stops(scene, "wavelength", 2) == [450.0, 650.0]
    angles = sweep_stops(scene, "theta-i")
    assert (angles[0], angles[-1], len(angles)) == (30.0, 60.0, 31)
    with pytest.raises(InputError, match="--frames 1:"):
        sweep_stops(scene, "wavelength", 1)


def test_nothing_to_sweep_over(tmp_path):
    lone = Subject("one", Scan([45.0], 0.0, [45.0], 180.0, [550.0], [[0.5]]))
    scene = Scene([Entry(lone, 550.0, 45.0)], size=(400, 300))
    for sweep, words in (
        ("wavelength", "has 550 nm only"),
        ("theta-i", "has one incident angle, 45°"),
    ):
        with pytest.raises(InputError, match=words):
            save_gif(scene, tmp_path / "a.gif", sweep)
    assert not list(tmp_path.iterdir())
    scene.close()


def test_film_mistakes(scene, foil, tmp_path, monkeypatch):
    odd = Scene([Entry(foil, 550.0, 45.0)], size=(401, 300))
    with pytest.raises(InputError, match="size 401x300: films need sides of even length"):
        save_mp4(odd, tmp_path / "a.mp4", "wavelength")
    odd.close()
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(InputError, match=r"pip install 'clbrdf\[film\]'"):
        save_mp4(scene, tmp_path / "a.mp4", "wavelength")


def test_an_interrupted_sweep_leaves_nothing(scene, tmp_path):
    def stop(done, total):
        raise KeyboardInterrupt

    for save, name in ((save_gif, "a.gif"), (save_mp4, "a.mp4")):
        with pytest.raises(KeyboardInterrupt):
            save(scene, tmp_path / name, "wavelength", report=stop)
    assert not list(tmp_path.iterdir())
