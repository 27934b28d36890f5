"""The sample is tilted or too high, and the stages do not stop where they say.

The result is reckoned with the nominal angles, by (2): P_s / (P_i Ω cosθr). What the instrument really
sees:

    tilt     the normal leans by `tilt` towards the azimuth `tilt_azimuth` of the nominal frame
    height   the face lies `height` in front of the axis of rotation; the beam, aimed at the axis, meets it at
             p = s h / cosθi (s towards the source), and the detector at distance L sees p from
             (L v − p) / |L v − p|, under a solid angle that is (L / |L v − p|)² of the nominal one
    stage    incident and view zenith are off by normal deviates, drawn for each direction

and the value measured is f(true directions) · cosθr,true / cosθr · (L / |L v − p|)².

Source: geometry; defaults from equation (4) of Wang, Zhang and Dong (2013): stage rotation 0.0003° (MRS101)
and 0.0002° (MRS103), holder height 0.03 mm. The paper names neither a tilt nor the detector's distance.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
import numpy.typing as npt
from pydantic import Field

from clbrdf.errors import InputError
from clbrdf.geometry import Directions, cos_deg
from clbrdf.instrument.vectors import angle_beside, directions_of, pair_of_vectors
from clbrdf.storage.tomlfile import TomlTable

Array = npt.NDArray[np.float64]


class Misalignment(TomlTable):
    """Settings.

    Attributes
    ----------
    tilt : float
        Of the sample's normal, degrees.
    tilt_azimuth : float
        Where it leans to, degrees from the azimuth of the source (φi = 0).
    height : float
        Of the face over the axis of rotation, mm.
    distance : float
        From the axis to the detector, mm.
    stage_i, stage_r : float
        Standard deviations of incident and view zenith, degrees.
    """

    tilt: Annotated[float, Field(ge=0.0, lt=45.0)] = 0.0
    tilt_azimuth: Annotated[float, Field(ge=-360.0, le=360.0)] = 0.0
    height: Annotated[float, Field(ge=-50.0, le=50.0)] = 0.03
    distance: Annotated[float, Field(gt=0.0)] = 300.0
    stage_i: Annotated[float, Field(ge=0.0, lt=5.0)] = 0.0003
    stage_r: Annotated[float, Field(ge=0.0, lt=5.0)] = 0.0002


def misaligned(settings: Misalignment, nominal: Directions, deviates: Array) -> tuple[Directions, Array]:
    """Return true directions (N) and the factor (N,) of the value, for standard normal deviates (N, 2).

    Raises
    ------
    InputError
        A direction comes to lie behind the face.
    """
    source, view = pair_of_vectors(nominal)
    source = angle_beside(source, settings.stage_i * deviates[:, 0], np.zeros(len(nominal)))
    view = angle_beside(view, settings.stage_r * deviates[:, 1], nominal.phi)
    towards = np.deg2rad(settings.tilt_azimuth)
    lean = np.deg2rad(settings.tilt)
    normal = np.array([np.sin(lean) * np.cos(towards), np.sin(lean) * np.sin(towards), np.cos(lean)])
    behind = (source @ normal <= 0.0) | (view @ normal <= 0.0)
    factor = np.ones(len(nominal))
    if settings.height and not behind.any():
        lit = source * (settings.height / (source @ normal))[:, None]
        seen = settings.distance * view - lit
        length = np.linalg.norm(seen, axis=1)
        view, factor = seen / length[:, None], (settings.distance / length) ** 2
        behind = view @ normal <= 0.0
    if behind.any():
        place = int(np.argmax(behind))
        raise InputError(
            f"effects.misalignment: the direction {nominal.theta_i[place]:g}°, {nominal.theta_r[place]:g}°"
            " comes to lie behind the tilted face; leave it out or tilt less"
        )
    true = directions_of(source, view, normal)
    return true, factor * (view @ normal) / cos_deg(nominal.theta_r)
