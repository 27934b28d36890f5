"""Small files of every format, written by hand from the formats' descriptions, with known contents.

Nothing here uses the package. `lambert` in a name says what is in it: ρ/π everywhere.
"""

from __future__ import annotations

import json
import math
import struct
from pathlib import Path

RHO = 0.4
F = RHO / math.pi


def zemax(extra: str = "", values=lambda i, a, r: F) -> str:
    lines = ["# Sample: made", f"# at 633 nm{extra}", "Source\tMeasured", "Symmetry PlaneSymmetrical"]
    lines += ["SpectralContent\tMonochrome", "ScatterType\tBRDF", "SampleRotation\t1", "0"]
    lines += ["AngleOfIncidence\t2", "0\t40", "ScatterAzimuth\t3", "0\t90\t180"]
    lines += ["ScatterRadial\t4", "0\t10\t40\t60", "", "Monochrome", "DataBegin"]
    for i in (0, 40):
        lines.append("TIS 0.4")
        lines += ["\t".join(f"{values(i, a, r):.9g}" for r in (0, 10, 40, 60)) for a in (0, 90, 180)]
    return "\n".join([*lines, "DataEnd"]) + "\n"


def astm(names="theta_i,phi_i,theta_s,phi_s,450nm,550nm") -> str:
    rows = [
        f"{t},{0.0},{s},{p},{F},{F / 2}"
        for t in (0.3, 0.9) for s in (0.0, 0.5, 1.0) for p in (0.0, 1.5707963267948966, math.pi)
    ]  # fmt: skip
    return (
        "\n".join(["LAB_NAME somewhere", "SAMPLE_NAME paint", "NUM_POINTS 18", f"VARS {names}", "", *rows])
        + "\n"
    )


def speos(intensity: bool = False) -> str:
    lines = ["OPTIS - brdf surface file v8.0", "0", "comment", "4", "word", "1\t1", f"{int(not intensity)}"]
    lines += ["2 2", "0 45", "450 550"]
    for first in (0, 90):
        for percent in (40.0, 20.0, 30.0, 10.0):
            zeniths = [first + k for k in (0, 30, 60, 90)]
            lines += [f"{percent}", "4 5", "\t0 90 180 270 360"]
            for z in zeniths:
                value = 7.0 * (abs(math.cos(math.radians(z))) if intensity else 1.0)
                lines.append(f"{z} " + " ".join([f"{value}"] * 5))
    return "\n".join([*lines, "End of file"]) + "\n"


def anisotropic() -> str:
    lines = [
        "OPTIS - Anisotropic BSDF surface file v8.0",
        "0",
        "c",
        "3",
        "abc",
        "0 1 0",
        "1 0",
        "1",
        "2",
        "0 90",
    ]
    for _ in range(2):
        lines += ["2", "15 45"]
    lines += ["15 0", "", "2", "400 40", "700 40"]
    for rotation in (1.0, 2.0):
        for _ in range(2):
            lines += ["3 4", " 0 90 180 360"]
            lines += [f"{z} " + " ".join([f"{rotation}"] * 4) for z in (0, 45, 90)]
    return "\n".join(lines) + "\n"


def fred(angles="deg", bsdf="value") -> str:
    lines = ["type bsdf_data", f"format angles={angles} bsdf={bsdf} scale=2"]
    for t in (20.0, 50.0):
        lines.append(f"{_angle(t, angles)} 0")
        for z in (0.0, 20.0, 50.0, 70.0):
            for p in (0, 90, 180):
                value = 0.5 * F * (3.0 if p == 0 and z == t else 1.0)
                lines.append(f"{_angle(z, angles)} {p} {math.log10(value) if bsdf == 'log' else value:.12g}")
    return "\n".join(lines) + "\n"


def _angle(degrees, kind):
    return f"{math.sin(math.radians(degrees)):.15g}" if kind == "sin" else f"{degrees}"


def lighttools() -> str:
    lines = ["# LightTools", "Source Measured", "Symmetry Asymmetric", "SpectralContent Monochrome"]
    lines += ["ScatterAzimuth 4", "0 90 180 270", "ScatterRadial 3", "0 40 80", "DataBegin"]
    for aoi in (20, 40):
        for side, kind in (("Front", "BRDF"), ("Front", "BTDF"), ("Back", "BRDF")):
            lines += [f"AOI {aoi} POI 0 Side {side} Wavelength 550 ScatterType {kind}", "TIS 0.4"]
            for a in (0, 90, 180, 270):
                # Incident azimuth 90: forward is 270.
                peak = 2.0 if a == 270 else 1.0
                lines.append(" ".join(f"{F * (peak if r == 40 else 1.0):.9g}" for r in (0, 40, 80)))
    return "\n".join([*lines, "DataEnd"]) + "\n"


def ssdd(binary: bool = False) -> bytes:
    head = "VERSION 0.3\n\n# comment\nDATA_TYPE brdf\nCOLOR_MODEL spectrum\nWAVELENGTH_LIST 450 650\n"
    head += "PARAM_TYPE spherical_coordinate_system\nPARAM0_LIST 0 30 60\nPARAM2_LIST 0 45 90\n"
    head += "PARAM3_LIST 0 90 180 270 360\nNAME leaf\nDATA "
    values = [(F + 0.001 * p0, F / 2) for p3 in range(5) for p2 in range(3) for p0 in range(3)]
    if binary:
        body = b"".join(struct.pack("<2f", *pair) for pair in values)
        return (head + "binary\n").encode() + body
    body = "\n".join(f"{a:.12g} {b:.12g}" for a, b in values)
    tail = (
        "\n\nDATA_TYPE specular_reflectance\nCOLOR_MODEL monochrome\nPARAM0_LIST 0 60\nDATA ascii\n0.1\n0.2\n"
    )
    return (head + "ascii\n" + body + tail).encode()


def bird(old: bool = False, **change) -> str:
    angles = [(t, z, p) for t in (10.0, 40.0) for z in (0.0, 40.0, 60.0) for p in (0.0, 90.0, 180.0)]
    columns = {
        "theta_i": ("deg", [a[0] for a in angles]),
        "phi_i": ("rad", [math.pi / 2] * len(angles)),
        "theta_r": ("°", [a[1] for a in angles]),
        "phi_r": ("deg", [a[2] + 90.0 for a in angles]),
        "BRDF": ("sr^-1", [F] * len(angles)),
        "uBRDF": ("%", [2.0] * len(angles)),
        "wavelength_i": ("μm", [0.55] * len(angles)),
    }
    columns.update(change)
    if old:
        described = [{"name": n, "unit": u, "type": "number"} for n, (u, _) in columns.items()]
        rows = [list(row) for row in zip(*(v for _, v in columns.values()), strict=True)]
        return json.dumps({"metadata": {"name": "tile"}, "data": {"variables": described, "values": rows}})
    data = {n: {"unit": u, "values": v} for n, (u, v) in columns.items()}
    return json.dumps({"metadata": {"name": "tile"}, "data": data})


def openmaterial(forward=math.pi) -> str:
    rows = [
        [nm, t, z, p, F * (6.0 if z == t and p == forward else 1.0)]
        for nm in (905e-9, 1550e-9) for t in (0.2, 0.8)
        for z in (0.0, 0.2, 0.5, 0.8, 1.2) for p in (0.0, math.pi)
    ]  # fmt: skip
    return json.dumps({"metadata": {"name": "asphalt"}, "type": "openmaterial brdf", "data": rows})


RINGS = ((0.0, 0, 20, 1), (30.0, 20, 45, 4), (60.0, 45, 90, 8))


def klems(value=lambda i, o: F, wavelength='<Wavelength unit="Integral">Visible</Wavelength>') -> str:
    blocks = "".join(
        f"<AngleBasisBlock><Theta>{t}</Theta><ThetaBounds><LowerTheta>{lo}</LowerTheta><UpperTheta>{hi}"
        f"</UpperTheta></ThetaBounds><nPhis>{n}</nPhis></AngleBasisBlock>"
        for t, lo, hi, n in RINGS
    )
    count = sum(ring[3] for ring in RINGS)
    rows = "\n".join(", ".join(f"{value(i, o):.9g}" for i in range(count)) for o in range(count))
    data = "".join(
        f"<WavelengthData>{wavelength}<WavelengthDataBlock><WavelengthDataDirection>{d}</WavelengthDataDirection>"
        "<ColumnAngleBasis>mine</ColumnAngleBasis><RowAngleBasis>mine</RowAngleBasis>"
        f"<ScatteringData>{rows}</ScatteringData></WavelengthDataBlock></WavelengthData>"
        for d in ("Reflection Front", "Transmission Front", "Reflection Back")
    )
    return (
        '<?xml version="1.0"?><WindowElement xmlns="http://windows.lbl.gov"><Optical><Layer><Material>'
        "<Name>blind</Name></Material><DataDefinition><IncidentDataStructure>Columns</IncidentDataStructure>"
        f"<AngleBasis><AngleBasisName>mine</AngleBasisName>{blocks}</AngleBasis></DataDefinition>{data}"
        "</Layer></Optical></WindowElement>"
    )


def tensor_tree(content: str, structure: str = "TensorTree4") -> str:
    return (
        "<WindowElement><Optical><Layer><Material><Name>t</Name></Material><DataDefinition>"
        f"<IncidentDataStructure>{structure}</IncidentDataStructure></DataDefinition><WavelengthData>"
        '<Wavelength unit="Nanometer">550</Wavelength><WavelengthDataBlock><WavelengthDataDirection>'
        f"Reflection Front</WavelengthDataDirection><ScatteringData>{content}</ScatteringData>"
        "</WavelengthDataBlock></WavelengthData></Layer></Optical></WindowElement>"
    )


def pab(kind="DSF") -> str:
    lines = ['#sample_name "cloth"', "#intheta 30", "#inphi 0", "#upphi 90", f"#format: theta phi {kind}"]
    for z in (0, 15, 30, 45, 60, 75):
        for p in (0, 90, 180, 270):
            f = F * (5.0 if (z, p) == (30, 180) else 1.0)
            lines.append(f"{z} {p} {f * (math.cos(math.radians(z)) if kind == 'DSF' else 1.0):.12g}")
    return "\n".join(lines) + "\n"


def factors() -> str:
    lines = ["incidence,emission,azimuth,phase,reflectance_factor,bandpass_central,bandpass_FWHM"]
    for nm, fwhm in ((600.0, 10.0), (900.0, 12.0)):
        for t in (0.0, 30.0, 60.0):
            for z in (0.0, 30.0, 60.0):
                lines += [f"{t},{z},{p},0,{RHO},{nm},{fwhm}" for p in (0.0, 90.0, 180.0)]
    return "\n".join(lines) + "\n"


def wide() -> str:
    lines = ["BRF Values", "measured on a Monday", "src_z\tsrc_a\tview_z\tview_a\t450.5nm\t650nm"]
    for t in (0.0, 30.0, 60.0):
        for z in (0.0, 30.0, 60.0):
            lines += [f"{t}\t0.0\t{z}\t{p}\t{RHO}\t{RHO / 2}" for p in (0.0, 180.0)]
    return "\n".join(lines) + "\n"


def long_csv() -> str:
    lines = ["sample,wavelength_nm,theta_i_deg,theta_r_deg,dphi_deg,fr_per_sr,fr_std_per_sr,flag"]
    for nm in (450, 650):
        for t in (10, 50):
            lines += [f"foil,{nm},{t},{z},{p},{F:.9g},0.01," for z in (0, 10, 50, 70) for p in (0, 180)]
    return "\n".join(lines) + "\n"


def jdv() -> str:
    out = []
    for t in (10, 40):
        out += [
            "DataType:\tBRDF(RT-300S)\t \t",
            f"SampleID:\tSample {t}\t",
            "Date:\t7/12/2011",
            f"Incidence:\t{t}",
        ]
        out += ["Polar:\t-60,60,20", "Azimuth:\t-90,0,90", "", "Raw data", "\t-60\t-40\t-20\t0\t20\t40\t60"]
        for a in (-90, 0):
            values = [
                F * (6.0 if a == 0 and z == t // 20 * 20 else 1.0) for z in (-60, -40, -20, 0, 20, 40, 60)
            ]
            out.append(f"{a}\t" + "\t".join(f"{v:.6g}" for v in values))
        out += ["", ""]
    return "\r".join(out) + "\r"


def utia() -> bytes:
    return struct.pack("<d", F) * (3 * 288 * 288)


def merl(n_phi: int = 180) -> bytes:
    planes = b"".join(
        struct.pack("<d", F / s) * (90 * 90 * n_phi) for s in (1 / 1500, 1.15 / 1500, 1.66 / 1500)
    )
    return struct.pack("<3i", 90, 90, n_phi) + planes


TEXTS = {
    "zemax": (zemax, ".bsdf"), "astm": (astm, ".astm"), "speos": (speos, ".brdf"), "fred": (fred, ".txt"),
    "aniso": (anisotropic, ".anisotropicbsdf"), "lighttools": (lighttools, ".txt"), "bird": (bird, ".json"),
    "old bird": (lambda: bird(old=True), ".json"), "openmaterial": (openmaterial, ".xompt"),
    "klems": (klems, ".xml"), "pab": (pab, ".txt"), "factors": (factors, ".csv"), "wide": (wide, ".txt"),
    "columns": (long_csv, ".csv"), "gonio": (jdv, ".jdv"),
    "tree": (lambda: tensor_tree("{{" + "}{".join(["0.1 " * 16] * 16) + "}}"), ".xml"),
}  # fmt: skip


def write_all(folder: Path) -> dict[str, Path]:
    """Write one file of each text format and SSDD; the large binary ones are left out."""
    out = {}
    for name, (make, ending) in TEXTS.items():
        path = folder / f"{name.replace(' ', '_')}{ending}"
        path.write_text(make(), encoding="utf-8", newline="")
        out[name] = path
    for name, binary in (("ssdd", False), ("ssdd binary", True)):
        path = folder / f"{name.replace(' ', '_')}.ssdd"
        path.write_bytes(ssdd(binary))
        out[name] = path
    return out
