"""Sound files of every kind that is read, small: what damage is done to."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

import clbrdf
from clbrdf import InputError, Scan
from clbrdf.rig.planfile import load_plan
from clbrdf.rig.rawscan import RawScan, write_raw
from clbrdf.rig.rigfile import load_rig
from clbrdf.rig.row import DARK, DIRECT, POINT, Row, columns, row_values
from clbrdf.rig.segment import SegmentWriter
from clbrdf.scan import open_scans, save_scans
from clbrdf.storage import hdf5
from tests.reference.naive import TIN_FOIL, brdf
from tests.rig.rig_helpers import write_plan, write_rig

SCENE = """
sample = "foil"
seed = 3
[surface]
model = "wang2013"
[surface.parameters]
a = 3.87
b = { polynomial = [0.5216, 0.005], centre = 570, scale = 190 }
c = -300.0
d = 0.74
ks = 451.8
kd = 1.3
[directions]
theta_i = [30, 45]
theta_r = { start = 0, stop = 60, step = 20 }
phi_r = 180
[wavelength]
start = 450
stop = 650
step = 100
[effects]
reader = { percent = 6.05 }
"""
BUDGET = """
mechanical = [{ name = "zenith", percent = 0.5 }]
detection = [{ name = "linearity", percent = 1.0, kind = "scale" }]
"""
PANEL = "theta_i,theta_r,phi,wavelength,brdf\n0,45,180,400,0.31\n0,45,180,700,0.312\n"


def scan() -> Scan:
    """Three incident angles, 16 view angles, two wavelengths: tin foil of Table 1."""
    theta_i, theta_r = np.repeat([30.0, 45.0, 60.0], 16), np.tile(np.linspace(0.0, 75.0, 16), 3)
    values = brdf(TIN_FOIL, theta_i, theta_r, 180.0)[:, None] * [0.9, 1.1]
    return Scan(
        *(theta_i, 0.0, theta_r, 180.0, [450.0, 650.0], values),
        sigma=0.05 * values, sample="foil", instrument="made", provenance={"made_by": "a test"},
        solid_angle=1e-3, bandpass=5.0,
        effects={"beam": {"angle": 0.5, "focussed": True}, "footprint": {"beam": 4.0, "field": 9.0}},
    )  # fmt: skip


def rows(pixels: int) -> list[Row]:
    """A dark, a direct beam and three points."""
    counts = np.arange(pixels, dtype=np.uint32) + 1600
    axes, out = np.zeros(3), []
    for k, kind in enumerate((DARK, DIRECT, POINT, POINT, POINT)):
        nominal = np.array([30.0, 0.0, 10.0 * k, 180.0]) if kind == POINT else np.full(4, np.nan)
        point, direct = (k - 2, 1) if kind == POINT else (-1, -1)
        dark = -1 if kind == DARK else 0
        time = f"2026-11-25T10:00:0{k}.000+00:00"
        out.append(
            Row(kind, point, time, axes, 1e-3, 0.01, dark, direct, 0, counts * (1 + k), nominal, 1, 20.0, -1)
        )
    return out


def raw(folder: Path) -> RawScan:
    """What a short measurement recorded."""
    table = {
        column.name: np.stack([row_values(row)[k] for row in rows(8)]) for k, column in enumerate(columns(8))
    }
    plan, rig = load_plan(write_plan(folder, step=20.0)), load_rig(write_rig(folder))
    return RawScan(plan, rig, np.linspace(500.0, 600.0, 8), np.array([1.0]), 16383, False, table, "a\nb", {})


def make(folder: Path) -> dict[str, bytes]:
    """Return the content of a file of each kind, by kind."""
    made = scan()
    made.save(folder / "scan.h5")
    save_scans(folder / "several.h5", {"one": made, "two": made.columns([0])})
    clbrdf.fit(made, weights="relative").save(folder / "fit.h5")
    clbrdf.choose(made, models=("lambert", "ggx+lambert")).save(folder / "choice.h5")
    with hdf5.create_file(folder / "raw.h5", "scan", "raw", False) as file:
        made.write(file["entry"])
        write_raw(file["entry"], raw(folder))
    writer = SegmentWriter(folder / "segment.h5", {"plan": "p", "rig": "r", "points": "3"}, 8, 0.0)
    for row in rows(8):
        writer.append(row)
    writer.close()
    write_table(folder / "long.csv", "columns", made)
    write_table(folder / "wide.csv", "wide", made)
    weights = [
        f"{i:g},{r:g},180,{k + 1}" for k, (i, r) in enumerate(zip(made.theta_i, made.theta_r, strict=True))
    ]
    (folder / "weights.csv").write_text("\n".join(["theta_i_deg,theta_r_deg,dphi_deg,weight", *weights]))
    (folder / "spectrum.csv").write_text("wavelength_nm,n\n400,1.4\n500,1.5\n600,1.52\n700,1.6\n")
    (folder / "panel.csv").write_text(PANEL)
    (folder / "scene.toml").write_text(SCENE)
    (folder / "budget.toml").write_text(BUDGET)
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir()) if path.suffix in ENDINGS}


ENDINGS = (".h5", ".csv", ".toml")


def write_table(path: Path, name: str, made: Scan) -> None:
    """Write a scan as text without its mark, so that the guard looks at it."""
    from clbrdf.formats.registry import get_format

    write = get_format(name).write
    assert write is not None
    write(made, path)
    lines = path.read_text(encoding="utf-8").split("\n")
    kept = [line for line in lines if not line.startswith("#")]
    path.write_text("\n".join(["# BRDF in 1/sr", *kept]), encoding="utf-8")


def readers(folder: Path) -> dict[str, Callable[[Path], object]]:
    """Return what reads a file of each kind, by kind; `folder` holds the sound ones."""
    from clbrdf.choose import Choice
    from clbrdf.fit.spectrum_file import read_spectrum
    from clbrdf.fit.weights_file import read_weights
    from clbrdf.formats.load import load
    from clbrdf.rig.budget import load_budget
    from clbrdf.rig.panel import load_panel
    from clbrdf.rig.rawscan import read_raw
    from clbrdf.rig.segment import read_header, read_rows
    from clbrdf.rig.segmentcheck import check_segments
    from clbrdf.scene.scenefile import load_scene
    from clbrdf.scene.simulate import set_up

    whole = scan()

    def segment(path: Path) -> None:
        check_segments([path])
        read_header(path)
        read_rows(path)

    def scene(path: Path) -> None:
        loaded = load_scene(path)
        try:
            set_up(loaded)
        except InputError as error:  # the command names the file
            raise InputError(f"{path}: {error}") from error

    return {
        "scan.h5": lambda path: Scan.open(path),
        "several.h5": lambda path: open_scans(path),
        "fit.h5": lambda path: clbrdf.Fit.open(path),
        "choice.h5": lambda path: Choice.open(path),
        "raw.h5": lambda path: read_raw(path),
        "segment.h5": segment,
        "long.csv": lambda path: load([path]),
        "wide.csv": lambda path: load([path]),
        "weights.csv": lambda path: read_weights(path, whole),
        "spectrum.csv": lambda path: read_spectrum(path, whole.wavelength),
        "panel.csv": lambda path: load_panel(path),
        "scene.toml": scene,
        "plan.toml": lambda path: load_plan(path).directions(),
        "rig.toml": lambda path: load_rig(path),
        "budget.toml": lambda path: load_budget(path),
    }
