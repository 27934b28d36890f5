"""Made files with one wrong convention each, and what the guard makes of them.

Surfaces are reciprocal by their formulas, which share nothing with the package: Lambert, GGX with Schlick's
Fresnel term and Smith's shadowing, and a lobe towards the source. A file says what the documentation of the
CSV format asks for; then one thing in it is not so.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from clbrdf import InputError
from clbrdf.formats.guard import Options
from clbrdf.formats.load import load_one

PLANTS = (
    "nothing", "radians", "micrometres", "forward at 0", "cosine", "factor pi", "percent", "from specular",
    "headings polar", "headings zeniths",
)  # fmt: skip


def vectors(theta_i, theta_r, phi):
    i, r, p = (
        np.deg2rad(a) for a in np.broadcast_arrays(*(np.atleast_1d(a) for a in (theta_i, theta_r, phi)))
    )
    source = np.stack([np.sin(i), 0 * i, np.cos(i)])
    view = np.stack([np.sin(r) * np.cos(p), np.sin(r) * np.sin(p), np.cos(r)])
    return source, view


def surface(rng):
    """A BRDF of θi, θr, φ (degrees, 180 forward), and words on it."""
    albedo = rng.uniform(0.02, 0.9)
    alpha = np.exp(rng.uniform(np.log(0.04), np.log(0.5)))
    f0 = rng.choice([0.04, 0.2, 0.8]) * rng.uniform(0.5, 1.0)
    kind = rng.choice(["matt", "glossy", "glossy", "metal", "back"])
    if kind == "metal":
        albedo = 0.0

    def brdf(theta_i, theta_r, phi):
        source, view = vectors(theta_i, theta_r, phi)
        lambert = albedo / np.pi * (1.0 - f0) + np.zeros(source.shape[1])
        if kind == "matt":
            return lambert
        if kind == "back":
            # Hapke's opposition term over a Lambertian: symmetric in source and view.
            cosine = np.clip((source * view).sum(axis=0), -1.0, 1.0)
            return lambert * (1.0 + 0.6 * np.exp(-np.arccos(cosine) / 0.5))
        half = source + view
        half = half / np.linalg.norm(half, axis=0)
        h2 = half[2] ** 2
        d = alpha**2 / (np.pi * (h2 * (alpha**2 - 1.0) + 1.0) ** 2)
        g = 1.0
        for z in (source[2], view[2]):
            g = g * 2.0 / (1.0 + np.sqrt(1.0 + alpha**2 * (1.0 / z**2 - 1.0)))
        fresnel = f0 + (1.0 - f0) * (1.0 - np.clip((source * half).sum(axis=0), 0, 1)) ** 5
        return lambert + d * g * fresnel / (4.0 * source[2] * view[2])

    return brdf, f"{kind}, alpha {alpha:.2f}, albedo {albedo:.2f}"


def directions(rng):
    incident = [np.array(a) for a in ([10, 30, 50, 70], [0, 20, 40, 60], [15, 45, 75], [30, 60])][
        rng.integers(4)
    ]
    step = rng.choice([5.0, 10.0])
    zeniths = np.arange(0.0, 81.0, step)
    if rng.random() < 0.5:
        phi = np.array([0.0, 180.0])
    else:
        phi = np.arange(0.0, 181.0 if rng.random() < 0.5 else 359.0, rng.choice([15.0, 30.0]))
    grid = np.meshgrid(incident.astype(float), zeniths, phi, indexing="ij")
    theta_i, theta_r, phi = (a.ravel() for a in grid)
    keep = ~((theta_r == 0.0) & (phi != 180.0) & (phi != 0.0))
    return theta_i[keep], theta_r[keep], phi[keep]


@dataclass(frozen=True)
class Case:
    plant: str
    words: str
    text: str
    theta_i: np.ndarray
    theta_r: np.ndarray
    phi: np.ndarray
    values: np.ndarray  # true, (N, W)
    wavelength: np.ndarray
    can_tell: bool


def make_case(seed: int) -> Case:
    rng = np.random.default_rng(seed)
    plant = PLANTS[seed % len(PLANTS)]
    brdf, words = surface(rng)
    theta_i, theta_r, phi = directions(rng)
    wavelength = np.array([450.0, 550.0, 650.0])[: rng.integers(1, 4)]
    tint = rng.uniform(0.8, 1.0, len(wavelength))
    values = brdf(theta_i, theta_r, phi)[:, None] * tint
    values = values * (1.0 + rng.choice([0.0, 0.003, 0.01]) * rng.standard_normal(values.shape))
    columns = {"theta_i": theta_i, "theta_r": theta_r, "phi": phi}
    shown, nm, can_tell = values, wavelength, True
    if plant == "radians":
        columns = {name: np.deg2rad(a) for name, a in columns.items()}
    elif plant == "micrometres":
        nm = wavelength / 1000.0
    elif plant == "forward at 0":
        columns["phi"] = np.mod(phi + 180.0, 360.0)
        at = theta_i.max() if theta_i.max() < 75 else np.unique(theta_i)[-2]
        front, back = (brdf(at, at, p)[0] for p in (180.0, 0.0))
        can_tell = bool(front / back > 3.0)
    elif plant == "cosine":
        shown = values * np.cos(np.deg2rad(theta_r))[:, None]
        pairs = np.isin(theta_i, theta_r) & np.isin(theta_r, theta_i) & (np.abs(theta_i - theta_r) > 5)
        can_tell = bool(pairs.sum() > 8)
    elif plant in ("factor pi", "percent"):
        shown = values * {"factor pi": np.pi, "percent": 100.0}[plant]
        # What a hemisphere of the smallest value in each ring would reflect: no surface reflects more.
        least = min(shown[theta_i == t].min(axis=0).max() for t in np.unique(theta_i))
        can_tell = bool(least * np.pi * np.sin(np.deg2rad(80.0)) ** 2 > 1.1)
    elif plant == "from specular":
        columns["theta_r"], columns["phi"] = about_specular(theta_i, theta_r, phi)
        can_tell = bool(brdf(50.0, 50.0, 180.0)[0] > 5 * brdf(50.0, 0.0, 0.0)[0])
    elif plant == "headings polar":
        columns["theta_r"], columns["phi"] = phi, theta_r
        can_tell = bool(np.unique(theta_r).size >= 3 and phi.max() > 90.0)
    elif plant == "headings zeniths":
        columns["theta_i"], columns["theta_r"] = theta_r, theta_i
    lines = ["wavelength_nm,theta_i_deg,theta_r_deg,dphi_deg,fr_per_sr"]
    for n in range(len(theta_i)):
        angles = ",".join(f"{columns[name][n]:.10g}" for name in ("theta_i", "theta_r", "phi"))
        lines += [f"{nm[w]:.10g},{angles},{shown[n, w]:.10g}" for w in range(len(nm))]
    return Case(plant, words, "\n".join(lines) + "\n", theta_i, theta_r, phi, values, wavelength, can_tell)


def about_specular(theta_i, theta_r, phi):
    """Angle and azimuth about the mirror direction, by turning vectors."""
    i = np.deg2rad(theta_i)
    _, view = vectors(theta_i, theta_r, phi)
    # Turn by θi about y so that the mirror direction (−sinθi, 0, cosθi) becomes z.
    x = np.cos(i) * view[0] + np.sin(i) * view[2]
    z = -np.sin(i) * view[0] + np.cos(i) * view[2]
    return np.rad2deg(np.arccos(np.clip(z, -1, 1))), np.mod(np.rad2deg(np.arctan2(view[1], x)), 360.0)


def is_right(case: Case, scan) -> bool:
    """Whether a scan holds the true values in the true directions; by reciprocity they may be exchanged."""
    if scan.brdf.shape != case.values.shape or not np.allclose(scan.wavelength, case.wavelength, atol=1e-6):
        return False
    if not np.allclose(scan.brdf, case.values, rtol=1e-6):
        return False
    source, view = vectors(case.theta_i, case.theta_r, case.phi)
    ours = vectors(scan.theta_i, scan.theta_r, scan.phi)
    same = np.allclose(ours[0], source, atol=1e-5) and np.allclose(ours[1], view, atol=1e-5)
    swapped = np.allclose(scan.theta_i, case.theta_r, atol=1e-5) and np.allclose(
        scan.theta_r, case.theta_i, atol=1e-5
    )
    return bool(same or swapped)


def offered(message: str) -> list[Options]:
    """The options that a message names."""
    import re

    out = []
    for name, value in re.findall(r"--(unit|phi-forward|cosine|scale|origin|swap) ([a-z0-9-]+)", message):
        if name == "unit":
            out.append(Options(angle=value) if value in ("deg", "rad") else Options(length=value))
        elif name == "phi-forward":
            out.append(Options(forward=float(value)))
        elif name == "cosine":
            out.append(Options(cosine=value == "included"))
        else:
            out.append(Options(**{name: value}))
    return out


def judge(case: Case, path) -> str:
    """One of: right, offered, refused, wrong, wrong and untellable."""
    path.write_text(case.text, encoding="utf-8")
    try:
        scan = load_one([path])
    except InputError as error:
        for options in offered(str(error)):
            try:
                if is_right(case, load_one([path], options=options)):
                    return "offered"
            except InputError:
                continue
        return "refused"
    if is_right(case, scan):
        return "right"
    return "wrong" if case.can_tell else "wrong and untellable"


def run(seeds, path) -> dict[str, Counter]:
    out: dict[str, Counter] = {plant: Counter() for plant in PLANTS}
    for seed in seeds:
        case = make_case(seed)
        verdict = judge(case, path)
        out[case.plant][verdict] += 1
        if verdict == "wrong":
            out[case.plant][f"wrong: seed {seed}: {case.words}"] += 1
    return out
