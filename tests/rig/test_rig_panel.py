"""A reference panel of known BRDF instead of the direct beam."""

import numpy as np
import pytest
from rig_helpers import write_plan, write_rig
from test_rig_measure import model_values

from clbrdf.errors import InputError
from clbrdf.rig.budget import POINTS_ONLY
from clbrdf.rig.emulator.rig import EmulatedRig
from clbrdf.rig.errors import InstrumentError
from clbrdf.rig.measure import measure
from clbrdf.rig.panel import load_panel
from clbrdf.rig.rawscan import read_raw
from clbrdf.rig.rigfile import load_rig
from clbrdf.rig.row import DIRECT, PANEL
from clbrdf.scan import Scan

TABLE = "theta_i,theta_r,phi,wavelength,brdf\n" + "".join(
    f"{theta_i},45,180,{wavelength},{value}\n"
    for theta_i, scale in ((0, 1.0), (10, 0.9))
    for wavelength, value in ((450, 0.30 * scale), (650, 0.32 * scale))
)


def rig_with_panel(folder, table=TABLE, more="", reach=""):
    (folder / "panel.csv").write_text(table)
    path = write_rig(folder)
    panel = f'panel = {{ file = "panel.csv", theta_i = 0, theta_r = 45, uncertainty = 0.02{more} }}'
    path.write_text(path.read_text().replace("solid_angle = 1.0e-3", f"solid_angle = 1.0e-3\n{panel}{reach}"))
    return path


def test_a_scan_against_a_panel(tmp_path):
    """The emulated surface is swapped for a matt panel when a person is asked to do so."""
    path = rig_with_panel(tmp_path)
    with EmulatedRig(load_rig(path)) as emulated:
        world = emulated.world
        sample, asked = world._surface, []
        truth = np.interp(world.wavelength, [450, 650], [0.30, 0.32])

        def ask(question):
            asked.append(question)
            world._surface = (lambda directions: truth) if "panel" in question else sample
            world._seen = None
            return ""

        measure(write_plan(tmp_path), path, tmp_path / "scan.h5", budget=POINTS_ONLY, ask=ask)
    scan, raw = Scan.open(tmp_path / "scan.h5"), read_raw(tmp_path / "scan.h5")
    assert [question[:11] for question in asked] == ["put the ref", "put the sam"] * 2
    assert np.count_nonzero(raw.rows["kind"] == PANEL) == 2
    assert not (raw.rows["kind"] == DIRECT).any()
    # Rounding of counts: the panel fills a quarter of the range at least, the darkest point less.
    assert scan.brdf == pytest.approx(np.broadcast_to(model_values(scan), scan.brdf.shape), rel=5e-3)
    assert np.median(scan.sigma / scan.brdf) == pytest.approx(0.02, rel=0.1), "the panel's own uncertainty"


def test_nobody_to_put_the_panel_in(tmp_path):
    path = rig_with_panel(tmp_path)
    with (
        EmulatedRig(load_rig(path)),
        pytest.raises(InstrumentError, match=r"put the reference panel .*terminal"),
    ):
        measure(write_plan(tmp_path), path, tmp_path / "scan.h5")


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ("theta_i,theta_r,phi,wavelength\n0,45,180,500\n", "no column brdf"),
        ("theta_i,theta_r,phi,wavelength,brdf\n", "no data"),
        ("theta_i,theta_r,phi,wavelength,brdf\n0,45,180,500,white\n", "line 2, column brdf: 'white' is not"),
        ("theta_i,theta_r,phi,wavelength,brdf\n0,45,180,500,-0.3\n", "line 2: brdf -0.3"),
        (TABLE + "20,45,180,450,0.3\n", "has other wavelengths"),
    ],
)
def test_bad_tables(tmp_path, table, words):
    (tmp_path / "panel.csv").write_text(table)
    with pytest.raises(InputError, match=words):
        load_panel(tmp_path / "panel.csv")
    with pytest.raises(InputError, match="no such file"):
        load_panel(tmp_path / "none.csv")


def test_a_table_that_is_too_short(tmp_path):
    short = TABLE.replace(",650,", ",550,")
    path = rig_with_panel(tmp_path, short)
    words = "the panel's table runs from 450 to 550 nm, and 49.* are needed"
    with EmulatedRig(load_rig(path)), pytest.raises(InputError, match=words):
        measure(write_plan(tmp_path), path, tmp_path / "scan.h5", ask=lambda question: "")
