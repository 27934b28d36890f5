"""What the guard takes, refuses and asks for."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from clbrdf import InputError
from clbrdf.formats.guard import Options
from clbrdf.formats.load import load, load_one
from tests.formats import conventions
from tests.formats import made_files as made


def test_rings_against_closed_forms():
    from clbrdf.formats.rings import ring_weights, turn_weights

    zenith = np.array([0.0, 7.0, 30.0, 61.0, 90.0])
    assert ring_weights(zenith).sum() == pytest.approx(0.5)  # ∫ sinθ cosθ
    assert ring_weights(zenith, cosine=False).sum() == pytest.approx(1.0)  # ∫ sinθ
    # ∫ θ sinθ cosθ dθ = π/8, ∫ θ sinθ dθ = 1: values linear in θ are met exactly.
    assert ring_weights(zenith) @ np.deg2rad(zenith) == pytest.approx(np.pi / 8)
    assert ring_weights(zenith, cosine=False) @ np.deg2rad(zenith) == pytest.approx(1.0)
    assert turn_weights(np.array([0.0, 90.0, 180.0])) == pytest.approx([0.25, 0.5, 0.25])
    assert turn_weights(np.array([0.0, 90.0, 180.0, 270.0])) == pytest.approx([0.25] * 4)
    assert turn_weights(np.array([0.0, 120.0, 240.0, 360.0])).sum() == pytest.approx(1.0)


def verdicts(found) -> Counter:
    total = Counter()
    for counts in found.values():
        total.update({word: count for word, count in counts.items() if "seed" not in word})
    return total


def test_200_planted_conventions(tmp_path):
    found = conventions.run(range(200), tmp_path / "case.csv")
    total = verdicts(found)
    assert total["wrong"] == 0, [word for counts in found.values() for word in counts if "seed" in word]
    # What is right stays unquestioned, and most of what is wrong is named.
    assert found["nothing"] == Counter(right=20)
    for plant in ("radians", "micrometres", "headings zeniths"):
        assert found[plant] == Counter(right=20)
    assert total["offered"] > 80


@pytest.mark.soak
def test_5000_planted_conventions(tmp_path):
    found = conventions.run(range(5000), tmp_path / "case.csv")
    for plant, counts in found.items():
        print(f"{plant:18s}", {word: count for word, count in counts.items() if "seed" not in word})
    total = verdicts(found)
    print(dict(total))
    assert total["wrong"] == 0, [word for counts in found.values() for word in counts if "seed" in word]
    assert found["nothing"]["right"] == 500


def put(tmp_path, text, name="case.csv"):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


GLOSSY = "wavelength_nm,theta_i_deg,theta_r_deg,dphi_deg,fr_per_sr\n" + "".join(
    f"550,{t},{z},{p},{0.05 + (3.0 if z == t and p == 180 else 0.0)}\n"
    for t in (20, 40, 60)
    for z in (0, 20, 40, 60, 75)
    for p in (0, 180)
)


def test_a_decision_is_told_and_kept(tmp_path):
    loaded = load([put(tmp_path, GLOSSY)])
    (decisions,) = loaded.decisions.values()
    (scan,) = loaded.scans.values()
    forward = next(d for d in decisions if d.name == "forward")
    assert str(forward).startswith("forward is φ = 180° (as such files have it; peak at φ = 180° at θr = 20°")
    assert str(forward) in scan.provenance.values()


def test_the_forward_half_plane_is_refused_where_the_peak_is_not_there(tmp_path):
    turned = put(tmp_path, GLOSSY.replace("180", "x").replace(",0,", ",180,").replace("x", "0"))
    text = "\n".join(
        ",".join([*line.split(",")[:3], {"0": "180", "180": "0"}[line.split(",")[3]], line.split(",")[4]])
        for line in GLOSSY.strip().split("\n")[1:]
    )
    turned = put(tmp_path, GLOSSY.split("\n")[0] + "\n" + text + "\n")
    with pytest.raises(
        InputError, match=r"peak at φ = 0°.* --phi-forward 0, or --phi-forward 180 for a surf"
    ):
        load_one([turned])
    for option, phi in ((0.0, 180.0), (180.0, 0.0)):
        scan = load_one([turned], options=Options(forward=option))
        assert set(scan.phi[scan.brdf[:, 0] > 1.0]) == {phi}


def test_zeniths_with_signs_need_no_azimuth(tmp_path):
    lines = ["wavelength_nm,theta_i_deg,theta_r_deg,fr_per_sr"]
    lines += [
        f"550,{t},{z},{0.05 + (3.0 if z == t else 0.0)}"
        for t in (20, 40, 60)
        for z in (-60, -40, -20, 0, 20, 40, 60)
    ]
    scan = load_one([put(tmp_path, "\n".join(lines) + "\n")])
    assert set(scan.phi[scan.brdf[:, 0] > 1.0]) == {180.0}
    # Incident zeniths below zero: the same, seen from the other side.
    turned = "\n".join(line.replace("550,", "550,-", 1) for line in lines)
    other = load_one([put(tmp_path, turned + "\n")], options=Options(forward=180.0))
    assert set(other.phi[other.brdf[:, 0] > 1.0]) == {180.0} or set(other.phi[other.brdf[:, 0] > 1.0]) == {
        0.0
    }
    assert (other.theta_i > 0.0).all()


def test_energy_names_the_scales_that_would_do(tmp_path):
    path = put(tmp_path, GLOSSY.replace("0.05\n", "0.9\n").replace("3.05", "3.9"))
    with pytest.raises(
        InputError, match=r"times what comes in; .* --scale pi or --scale percent .* at its word"
    ):
        load_one([path])
    scan = load_one([path], options=Options(scale="pi"))
    assert scan.brdf.min() == pytest.approx(0.9 / np.pi)
    assert load_one([path], options=Options(scale="1")).brdf.min() == 0.9


def test_angles_in_radians_under_a_heading_of_degrees(tmp_path):
    head, *rows = GLOSSY.strip().split("\n")
    turned = []
    for row in rows:
        nm, t, z, p, f = row.split(",")
        turned.append(",".join([nm, *(f"{np.deg2rad(float(a)):.9g}" for a in (t, z, p)), f]))
    scan = load_one([put(tmp_path, "\n".join([head, *turned]) + "\n")])
    assert np.unique(scan.theta_r) == pytest.approx([0.0, 20.0, 40.0, 60.0, 75.0])
    flat = "\n".join([head, *(row for row in turned if row.split(",")[3] == "0")])
    with pytest.raises(InputError, match=r"fits radians as well as degrees .* --unit deg or --unit rad"):
        load_one([put(tmp_path, flat + "\n")])


@pytest.mark.parametrize(
    ("wavelength", "header", "nm"), [("0.55", "nm", 550.0), ("550", "um", 550.0), ("10.6", "um", 10600.0)]
)
def test_wavelengths_tell_their_unit(tmp_path, wavelength, header, nm):
    text = GLOSSY.replace("550,", f"{wavelength},").replace("wavelength_nm", f"wavelength_{header}")
    assert load_one([put(tmp_path, text)]).wavelength == pytest.approx([nm])


def test_an_extreme_ultraviolet_wavelength_asks(tmp_path):
    with pytest.raises(InputError, match=r"13\.5 to 13\.5 may be in nm or in µm"):
        load_one([put(tmp_path, GLOSSY.replace("550,", "13.5,"))])


def test_a_wavelength_for_a_file_that_names_none(tmp_path):
    path = put(tmp_path, made.fred(), "x.txt")
    assert load_one([path]).bands == ("monochrome",)
    assert load_one([path], options=Options(wavelength=633.0)).wavelength.tolist() == [633.0]
    with pytest.raises(InputError, match="has wavelengths of its own; leave --wavelength out"):
        load_one([put(tmp_path, GLOSSY)], options=Options(wavelength=633.0))


def test_directions_on_the_horizon_are_left_out_and_told(tmp_path):
    loaded = load([put(tmp_path, GLOSSY.replace(",75,", ",90,"))])
    (scan,), (decisions,) = loaded.scans.values(), loaded.decisions.values()
    assert len(scan) == 24
    assert any(d.taken == "6 directions left out" for d in decisions)


@pytest.mark.parametrize(
    ("name", "value"), [("angle", "gon"), ("forward", 90.0), ("scale", "2"), ("swap", "x")]
)
def test_impossible_options_are_refused(name, value):
    with pytest.raises(InputError, match=f"{name} is {value}; give one of"):
        Options(**{name: value})


def test_tis_of_a_zemax_file_is_compared(tmp_path):
    loaded = load([put(tmp_path, made.zemax(), "a.bsdf")])
    (decisions,) = loaded.decisions.values()
    assert any("TIS of the file is" in d.taken for d in decisions)
