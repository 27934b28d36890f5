"""Pictures and sweeps in files."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from PIL import Image

from clbrdf import InputError, Scan
from clbrdf.viz.panel import LobeRequest
from clbrdf.viz.picture import Picture
from clbrdf.viz.stills import pixels, save_gif, save_mp4, save_png, sweep_stops
from clbrdf.viz.style import LobeStyle
from clbrdf.viz.subject import Subject

pytestmark = pytest.mark.usefixtures("gl")


@pytest.fixture
def picture(foil):
    made = Picture([LobeRequest(foil, 550.0, 45.0)], LobeStyle(radius="log"), size=(400, 300))
    yield made
    made.close()


def test_png_has_the_size_and_the_background_asked_for(picture, tmp_path):
    save_png(picture, tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as file:
        assert file.size == (400, 300)
        np.testing.assert_array_equal(np.asarray(file), pixels(picture))
    save_png(picture, tmp_path / "b.png", transparent=True)
    with Image.open(tmp_path / "b.png") as file:
        assert file.mode == "RGBA"
        assert file.getpixel((399, 299))[3] == 0
    with pytest.raises(InputError, match="exists already"):
        save_png(picture, tmp_path / "a.png")


def test_words_without_a_background_are_legible_on_black_and_on_white(picture):
    """The title: dark letters, and a light rim around them."""
    whole = pixels(picture, transparent=True)
    title = Image.fromarray(np.ascontiguousarray(whole[3:20, 5:60]))
    for ground in ((0, 0, 0, 255), (255, 255, 255, 255)):
        under = Image.new("RGBA", title.size, ground)
        under.alpha_composite(title)
        grey = np.asarray(under.convert("L")).astype(int)
        assert (grey > 230).mean() > 0.08
        assert (grey < 60).mean() > 0.05


def test_gif_goes_there_and_back_with_one_scale(picture, tmp_path):
    told = []
    stops = save_gif(picture, tmp_path / "a.gif", "wavelength", report=lambda k, n: told.append((k, n)))
    assert stops == 3
    assert told == [(1, 3), (2, 3), (3, 3)]
    assert picture.held is not None
    # The longest value of all frames: 650 nm, 1.1 times Table 1 at 45°.
    assert picture.held.top == pytest.approx(1.1 * 657.6, rel=1e-3)
    with Image.open(tmp_path / "a.gif") as file:
        assert file.n_frames == 4
        first = np.asarray(file.convert("RGB")).astype(int)
        file.seek(2)
        assert np.abs(np.asarray(file.convert("RGB")) - first).max() > 60


def test_mp4_is_a_film_of_as_many_frames(picture, tmp_path):
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
    assert save_mp4(picture, tmp_path / "a.mp4", "theta-i", frames=5) == 5
    assert imageio_ffmpeg.count_frames_and_secs(str(tmp_path / "a.mp4"))[0] == 5
    assert [p.name for p in tmp_path.iterdir()] == ["a.mp4"]


def test_sweeps(picture, foil):
    assert sweep_stops(picture, "wavelength") == [450.0, 550.0, 650.0]
    assert sweep_stops(picture, "wavelength", 2) == [450.0, 650.0]
    angles = sweep_stops(picture, "theta-i")
    assert (angles[0], angles[-1], len(angles)) == (30.0, 60.0, 31)
    with pytest.raises(InputError, match="frames=1:"):
        sweep_stops(picture, "wavelength", 1)


def test_nothing_to_sweep_over(tmp_path):
    lone = Subject("one", Scan([45.0], 0.0, [45.0], 180.0, [550.0], [[0.5]]))
    picture = Picture([LobeRequest(lone, 550.0, 45.0)], size=(400, 300))
    for sweep, words in (
        ("wavelength", "has 550 nm only"),
        ("theta-i", "has one incident angle, 45°"),
    ):
        with pytest.raises(InputError, match=words):
            save_gif(picture, tmp_path / "a.gif", sweep)
    assert not list(tmp_path.iterdir())
    picture.close()


def test_film_mistakes(picture, foil, tmp_path, monkeypatch):
    odd = Picture([LobeRequest(foil, 550.0, 45.0)], size=(401, 300))
    with pytest.raises(InputError, match="size 401x300: films need sides of even length"):
        save_mp4(odd, tmp_path / "a.mp4", "wavelength")
    odd.close()
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(InputError, match=r"pip install 'clbrdf\[film\]'"):
        save_mp4(picture, tmp_path / "a.mp4", "wavelength")


def test_an_interrupted_sweep_leaves_nothing(picture, tmp_path):
    def stop(done, total):
        raise KeyboardInterrupt

    for save, name in ((save_gif, "a.gif"), (save_mp4, "a.mp4")):
        with pytest.raises(KeyboardInterrupt):
            save(picture, tmp_path / name, "wavelength", report=stop)
    assert not list(tmp_path.iterdir())
