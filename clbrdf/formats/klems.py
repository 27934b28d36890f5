"""Klems patches: directions of a basis and the matrix over two of them.

Patches of a ring have equal azimuths 360° k / n. The directly transmitted, or mirrored, light is on the
diagonal: outgoing azimuths are counted from behind, so that φ = φout − φin + 180°.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.formats.reading import SURE as ALL
from clbrdf.formats.reading import Reading, Stated
from clbrdf.formats.text import numbers

Array = npt.NDArray[np.float64]

MOST_PATCHES = 10_000


@dataclass(frozen=True, eq=False)
class Basis:
    """Patches of a hemisphere.

    Attributes
    ----------
    name : str
    theta, phi : (P,) float64
        Centres, degrees.
    low, high : (P,) float64
        Bounds of the zenith, degrees.
    count : (P,) int
        Patches of the ring.
    """

    name: str
    theta: Array
    phi: Array
    low: Array
    high: Array
    count: npt.NDArray[np.intp]

    @property
    def projected(self) -> Array:
        """Λ, the projected solid angle of each patch, sr: (π/n) (sin²θhigh − sin²θlow)."""
        low, high = np.deg2rad(self.low), np.deg2rad(self.high)
        return np.asarray(np.pi / self.count * (np.sin(high) ** 2 - np.sin(low) ** 2))

    @property
    def solid_angle(self) -> Array:
        """Solid angle of each patch, sr: (2π/n) (cosθlow − cosθhigh)."""
        low, high = np.deg2rad(self.low), np.deg2rad(self.high)
        return np.asarray(2.0 * np.pi / self.count * (np.cos(low) - np.cos(high)))


def bases(path: Path, layer: ET.Element) -> dict[str, Basis]:
    """Return the bases that a layer defines, by name in lower case.

    Raises
    ------
    InputError
        A block without bounds or counts, or out of range.
    """
    out = {}
    for item in layer.findall(".//AngleBasis"):
        name = (item.findtext("AngleBasisName") or "").strip()
        rings = []
        for block in item.findall("AngleBasisBlock"):
            words = [
                block.findtext(w)
                for w in ("Theta", "ThetaBounds/LowerTheta", "ThetaBounds/UpperTheta", "nPhis")
            ]
            try:
                theta, lower, upper, share = (float(word or "") for word in words)
            except ValueError:
                raise InputError(f"{path}: an AngleBasisBlock of {name!r} lacks a number") from None
            if not (0.0 <= lower < upper <= 90.0 and lower <= theta <= upper and 1 <= share <= MOST_PATCHES):
                raise InputError(
                    f"{path}: an AngleBasisBlock of {name!r} from {lower:g}° to {upper:g}° is impossible"
                )
            rings.append((theta, lower, upper, int(share)))
        if not rings or sum(ring[3] for ring in rings) > MOST_PATCHES:
            raise InputError(
                f"{path}: AngleBasis {name!r} has no blocks, or more than {MOST_PATCHES} patches"
            )
        count = np.array([ring[3] for ring in rings], dtype=np.intp)
        bounds = np.repeat(np.array([ring[:3] for ring in rings], dtype=np.float64), count, axis=0)
        phi = np.concatenate([360.0 * np.arange(n) / n for n in count])
        whole = np.repeat(count, count)
        out[name.casefold()] = Basis(name, bounds[:, 0], phi, bounds[:, 1], bounds[:, 2], whole)
    return out


def matrix_reading(
    path: Path, content: str, incident: Basis, outgoing: Basis, transmission: bool, by_rows: bool
) -> Reading:
    """Return a matrix over patches as a reading; its band is set by the caller.

    Raises
    ------
    InputError
        Another number of values than patches need, or words that are no numbers.
    """
    values = numbers(path, content)
    n_in, n_out = len(incident.theta), len(outgoing.theta)
    if len(values) != n_in * n_out:
        raise InputError(
            f"{path}: a ScatteringData has {len(values)} values, and {outgoing.name} × {incident.name}"
            f" need {n_out} × {n_in} = {n_in * n_out}; the file is cut"
        )
    matrix = values.reshape(n_in, n_out).T if by_rows else values.reshape(n_out, n_in)
    j, i = (a.ravel() for a in np.meshgrid(np.arange(n_out), np.arange(n_in), indexing="ij"))
    theta_r = outgoing.theta[j]
    return Reading(
        incident.theta[i],
        incident.phi[i],
        180.0 - theta_r if transmission else theta_r,
        outgoing.phi[j] + 180.0,
        matrix.reshape(-1, 1),
        bands=("unnamed",),
        stated=Stated(sure=ALL),
        extra={"solid_angle": outgoing.solid_angle[j]},
    )
