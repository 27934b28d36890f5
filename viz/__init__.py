"""Pictures: lobes in windows, files and browsers; curves, spectra and reports of a fit.

The heavy libraries (VTK, matplotlib) load when a picture is made.
"""

from clbrdf.viz.demo import demo_pictures
from clbrdf.viz.report import write_report

__all__ = ["demo_pictures", "write_report"]
