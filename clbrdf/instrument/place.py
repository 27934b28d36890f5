"""From an instrument to the nodes that stand for each measured direction."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError, advice
from clbrdf.geometry import ANGLES, Directions
from clbrdf.instrument.aperture import aperture_nodes
from clbrdf.instrument.beam import beam_nodes
from clbrdf.instrument.footprint import seen_share
from clbrdf.instrument.misalignment import misaligned
from clbrdf.instrument.rules import LADDER, POINT, Rule
from clbrdf.instrument.settings import Instrument
from clbrdf.instrument.vectors import pair_of_vectors, zenith_azimuth
from clbrdf.observation import Observation

Array = npt.NDArray[np.float64]
Levels = npt.NDArray[np.uint8]

LOWEST = 89.999
"""Zenith, degrees, up to which a cone may reach."""


def observation_of(
    instrument: Instrument, angle: Array | None, directions: Directions, levels: Levels
) -> Observation:
    """Return what an instrument sees in N measured directions.

    Parameters
    ----------
    instrument : Instrument
    angle : (N,) float64 or None
        Full angle of the aperture at each direction, degrees; 0 where it is a point.
    directions : Directions
        N, as they were meant.
    levels : (N, 2) uint8
        Places in LADDER of the rules for beam and aperture.
    """
    true, factor = _true(instrument, directions)
    weight = np.ones(len(directions)) if factor is None else factor
    if instrument.footprint is not None:
        weight = weight * seen_share(instrument.footprint, directions)
    parts = []
    for pair in np.unique(levels, axis=0):
        places = np.flatnonzero((levels == pair).all(axis=1))
        part, shares = _nodes(
            instrument,
            None if angle is None else angle[places],
            true[places],
            LADDER[pair[0]],
            LADDER[pair[1]],
        )
        parts.append((part, np.repeat(places, shares.shape[1]), (shares * weight[places, None]).ravel()))
    owner = np.concatenate([part[1] for part in parts])
    order = np.argsort(owner, kind="stable")
    angles = [np.concatenate([getattr(part[0], name) for part in parts])[order] for name in ANGLES]
    return Observation(Directions(*angles), owner[order], np.concatenate([part[2] for part in parts])[order])


def above_horizon(
    instrument: Instrument, angle: Array | None, directions: Directions
) -> npt.NDArray[np.bool_]:
    """Return where no cone reaches below the horizon, (N,); arguments are as of `observation_of`."""
    lean, beam = instrument.misalignment, 0.0 if instrument.beam is None else instrument.beam.angle
    full = np.zeros(len(directions)) if angle is None else angle
    tilt = 0.0 if lean is None else lean.tilt
    out = directions.theta_i + tilt + beam / 2.0 < LOWEST
    out &= directions.theta_r + tilt + full / 2.0 < LOWEST
    if lean is not None:
        # A face that is too high hides itself from a detector that looks along it.
        out &= lean.distance * np.cos(np.deg2rad(directions.theta_r + tilt)) > lean.height
        true, _ = _true(instrument, directions[out])
        out[out] = (true.theta_i + beam / 2.0 < LOWEST) & (true.theta_r + full[out] / 2.0 < LOWEST)
    return np.asarray(out)


def check_horizon(instrument: Instrument, angle: Array | None, directions: Directions, where: str) -> None:
    """Raise InputError where a cone reaches below the horizon, where no model has a value.

    `where` stands for the source of the settings in the message.
    """
    true, _ = _true(instrument, directions)
    beam = np.full(len(true), 0.0 if instrument.beam is None else instrument.beam.angle)
    for name, word, zenith, full in (
        ("beam", "θi", true.theta_i, beam),
        ("aperture", "θr", true.theta_r, np.zeros(len(true)) if angle is None else angle),
    ):
        reach = np.where(full > 0.0, zenith + full / 2.0, 0.0)
        if reach.max() >= LOWEST:
            k = int(reach.argmax())
            width = float(full[k])
            points = advice("through='point'", "--point")
            raise InputError(
                f"{where}: {name} of {width:.3g}° about {word} = {zenith[k]:g}° reaches below the horizon;"
                f" leave out directions beyond {LOWEST - width / 2.0:.5g}°, or fit points ({points})"
            )


def _true(instrument: Instrument, directions: Directions) -> tuple[Directions, Array | None]:
    """Where the directions really are, and the factor of their values."""
    if instrument.misalignment is None:
        return directions, None
    true, factor = misaligned(instrument.misalignment, directions, np.zeros((len(directions), 2)))
    return _turned(true, directions.phi_i), factor


def _nodes(
    instrument: Instrument, angle: Array | None, true: Directions, of_beam: Rule, of_aperture: Rule
) -> tuple[Directions, Array]:
    """Nodes (N K) about directions (N), and their shares (N, K)."""
    n, shares = len(true), np.ones((len(true), 1))
    if of_beam == of_aperture == POINT:
        return true, shares
    source, view = pair_of_vectors(true)
    azimuth, widths = true.phi_i, angle
    if instrument.beam is not None and of_beam != POINT:
        nodes, shares = beam_nodes(instrument.beam, source, view, of_beam)
        count = nodes.shape[1]
        source, view, azimuth = (
            nodes.reshape(-1, 3),
            np.repeat(view, count, axis=0),
            np.repeat(azimuth, count),
        )
        widths = None if angle is None else np.repeat(angle, count)
    if widths is not None and of_aperture != POINT:
        nodes, inner = aperture_nodes(widths, source, view, of_aperture)
        count = nodes.shape[1]
        source, view, azimuth = (
            np.repeat(source, count, axis=0),
            nodes.reshape(-1, 3),
            np.repeat(azimuth, count),
        )
        shares = (shares[..., None] * inner.reshape(n, -1, count)).reshape(n, -1)
    (theta_i, phi_i), (theta_r, phi_r) = zenith_azimuth(source), zenith_azimuth(view)
    return _turned(Directions(theta_i, phi_i, theta_r, phi_r), azimuth), shares


def _turned(directions: Directions, azimuth: Array) -> Directions:
    """Turn directions about the normal, degrees."""
    angles = directions.theta_i, directions.phi_i + azimuth, directions.theta_r, directions.phi_r + azimuth
    return Directions(*angles)
