"""Every model as its source prints it, in arithmetic of 150 digits and more.

The forms are the published ones: half vectors from vector arithmetic, the phase angle by acos, Fresnel's
formulas with complex numbers, Smith's Λ. What cancels in them is paid for in digits and not rearranged, so
that they share nothing with forms made for 16 digits.

Angles are in degrees, φ = φr − φi is 180° in the forward half-plane and 0 in the source's; the BRDF is in
1/sr without the cosine. `sigma` of oren_nayar is in radians, `theta_bar` of hapke in degrees. The x axis of
the anisotropic models is azimuth 0 of the sample.
"""

from __future__ import annotations

from mpmath import mpf

from tests.reference.models.abg import ABG
from tests.reference.models.beckmann import BECKMANN, BECKMANN_CONDUCTOR, BECKMANN_DIELECTRIC
from tests.reference.models.eon import EON
from tests.reference.models.geometry import Angles
from tests.reference.models.ggx import GGX, GGX_ANISOTROPIC, GGX_CONDUCTOR, GGX_DIELECTRIC
from tests.reference.models.hapke import HAPKE
from tests.reference.models.kcorr import KCORR
from tests.reference.models.lambert import LAMBERT
from tests.reference.models.minnaert import MINNAERT
from tests.reference.models.oren_nayar import OREN_NAYAR
from tests.reference.models.rayleigh_rice import RAYLEIGH_RICE
from tests.reference.models.reference import Parameters, Reference
from tests.reference.models.ross_li import ROSS_LI
from tests.reference.models.rpv import RPV
from tests.reference.models.wang2013 import WANG2013
from tests.reference.models.ward import WARD, WARD_ANISOTROPIC

__all__ = ["REFERENCES", "Angles", "Reference", "gradient"]

REFERENCES: dict[str, Reference] = {
    "lambert": LAMBERT,
    "minnaert": MINNAERT,
    "eon": EON,
    "oren_nayar": OREN_NAYAR,
    "ggx": GGX,
    "ggx_dielectric": GGX_DIELECTRIC,
    "ggx_conductor": GGX_CONDUCTOR,
    "ggx_anisotropic": GGX_ANISOTROPIC,
    "beckmann": BECKMANN,
    "beckmann_dielectric": BECKMANN_DIELECTRIC,
    "beckmann_conductor": BECKMANN_CONDUCTOR,
    "ward": WARD,
    "ward_anisotropic": WARD_ANISOTROPIC,
    "abg": ABG,
    "kcorr": KCORR,
    "rayleigh_rice": RAYLEIGH_RICE,
    "ross_li": ROSS_LI,
    "rpv": RPV,
    "hapke": HAPKE,
    "wang2013": WANG2013,
}


def gradient(
    name: str, parameters: Parameters, angles: Angles, wavelength: float | None = None
) -> dict[str, mpf]:
    """Give the derivatives of a model's BRDF by its parameters; angles as theta_i, phi_i, theta_r, phi_r."""
    return REFERENCES[name].gradient(parameters, angles, wavelength)
