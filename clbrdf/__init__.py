"""clbrdf: from a measured scan to an absolute spectral BRDF, its model at every wavelength, and lobes.

The flat names here are the public interface; heavy libraries (OpenCL, HDF5, VTK) load when used.
"""

# `choose`, `fit` and `evaluate` are functions here and hide the modules of the same name; import from those
# with `from clbrdf.fit.polish import …` (docs/decisions/0001).
from clbrdf.choose import Choice, choose
from clbrdf.errors import ClbrdfError, DeviceError, InputError
from clbrdf.evaluate import evaluate
from clbrdf.fit import Fit, fit
from clbrdf.geometry import Directions
from clbrdf.opencl.cheapest import choose_precision
from clbrdf.scan import Scan
from clbrdf.version import __version__

__all__ = [
    "Choice",
    "ClbrdfError",
    "DeviceError",
    "Directions",
    "Fit",
    "InputError",
    "Scan",
    "__version__",
    "choose",
    "choose_precision",
    "evaluate",
    "fit",
]
