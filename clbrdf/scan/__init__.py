"""A scan: what was measured where, at which wavelength, with which uncertainty (`record.py`)."""

from clbrdf.scan.component import Component
from clbrdf.scan.correlation import Correlation
from clbrdf.scan.record import Scan
from clbrdf.scan.several import open_scans, save_scans

__all__ = ["Component", "Correlation", "Scan", "open_scans", "save_scans"]
