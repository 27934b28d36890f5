"""Tensor trees of Radiance (G. Ward 2012): nested braces, leaves of equal cells, Shirley–Chiu squares.

A node has 2^N children (bit d of the child's number is its half in dimension d) or a grid of equal cells,
dimension 0 slowest. In 4 dimensions 0 and 1 are the square of the reversed incident direction, 2 and 3 that
of the outgoing one; in 3, dimension 0 is (1 − sinθi)/2. The squares map to the disc of (sinθ, φ), so that
equal cells have equal projected solid angles.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.formats.reading import SURE as ALL
from clbrdf.formats.reading import Reading, Stated
from clbrdf.formats.text import numbers

Array = npt.NDArray[np.float64]

DEEPEST = 12
MOST_CELLS = 20_000_000


def tree_reading(path: Path, content: str, dimensions: int, transmission: bool) -> Reading:
    """Return a tensor tree as a reading, a direction for the centre of each cell.

    Raises
    ------
    InputError
        Braces that do not close, a node with another number of children or cells, too deep a tree.
    """
    centres, values = [], []
    for corner, size, cells in _leaves(path, content, dimensions):
        side = round(len(cells) ** (1.0 / dimensions))
        steps = (np.arange(side) + 0.5) * (size / side)
        axes = np.meshgrid(*[corner[d] + steps for d in range(dimensions)], indexing="ij")
        centres.append(np.stack([axis.ravel() for axis in axes], axis=1))
        values.append(cells)
    places, found = np.concatenate(centres), np.concatenate(values)
    if dimensions == 3:
        # The other half of dimension 0 stands for no direction.
        keep = places[:, 0] < 0.5
        places, found = places[keep], found[keep]
        sine = 1.0 - 2.0 * places[:, 0]
        theta_i, phi_i = np.rad2deg(np.arcsin(np.clip(sine, 0.0, 1.0))), np.zeros(len(sine))
        theta_r, phi_r = from_square(places[:, 1], places[:, 2])
    else:
        theta_i, phi_i = from_square(places[:, 0], places[:, 1])
        phi_i = phi_i + 180.0
        theta_r, phi_r = from_square(places[:, 2], places[:, 3])
    return Reading(
        theta_i,
        phi_i,
        180.0 - theta_r if transmission else theta_r,
        phi_r,
        found[:, None],
        bands=("unnamed",),
        stated=Stated(sure=ALL),
    )


def from_square(u: Array, v: Array) -> tuple[Array, Array]:
    """Return zenith and azimuth, degrees, of points of the unit square (Shirley and Chiu 1997)."""
    x, y = 2.0 * u - 1.0, 2.0 * v - 1.0
    steep = np.abs(y) > np.abs(x)
    radius = np.where(steep, y, x)
    with np.errstate(divide="ignore", invalid="ignore"):
        turn = np.where(steep, 90.0 - 45.0 * (x / y), 45.0 * (y / x))
    turn = np.where(radius == 0.0, 0.0, turn)
    azimuth = np.where(radius < 0.0, turn + 180.0, turn)
    return np.rad2deg(np.arcsin(np.clip(np.abs(radius), 0.0, 1.0))), np.mod(azimuth, 360.0)


def _leaves(path: Path, content: str, dimensions: int) -> list[tuple[Array, float, Array]]:
    """Return (corner, edge, cells) of all leaves, without recursion."""
    out: list[tuple[Array, float, Array]] = []
    stack: list[tuple[Array, float, int]] = []  # corner, edge, next child
    whole = (np.zeros(dimensions), 1.0)
    done, total = False, 0
    for match in re.finditer(r"[{}]|[^{}]+", content):
        token = match.group()
        if token == "{":
            if done or len(stack) > DEEPEST:
                raise InputError(
                    f"{path}: a tensor tree with {'a second root' if done else 'too many levels'}"
                )
            if not stack:
                stack.append((*whole, 0))
                continue
            corner, edge, child = stack[-1]
            if child < 0 or child >= 2**dimensions:
                raise InputError(f"{path}: a node of a tensor tree has more than {2**dimensions} children")
            stack[-1] = (corner, edge, child + 1)
            half = edge / 2.0
            bits = np.array([(child >> d) & 1 for d in range(dimensions)])
            stack.append((corner + half * bits, half, 0))
        elif token == "}":
            if not stack:
                raise InputError(f"{path}: a tensor tree closes a brace too many")
            _, _, child = stack.pop()
            if child not in (-1, 2**dimensions):
                raise InputError(f"{path}: a node of a tensor tree has {child} children, not {2**dimensions}")
            done = not stack
        elif token.replace(",", " ").strip():
            if not stack or stack[-1][2] != 0:
                raise InputError(f"{path}: values of a tensor tree stand beside its nodes")
            corner, edge, _ = stack[-1]
            cells = numbers(path, token)
            side = round(len(cells) ** (1.0 / dimensions))
            total += len(cells)
            if side**dimensions != len(cells) or total > MOST_CELLS:
                raise InputError(
                    f"{path}: a leaf of a tensor tree has {len(cells)} cells, no power of {dimensions}"
                )
            out.append((corner, edge, cells))
            stack[-1] = (corner, edge, -1)
    if not done or not out:
        raise InputError(f"{path}: a tensor tree does not close; the file is cut")
    return out
