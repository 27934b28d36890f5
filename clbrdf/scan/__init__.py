"""A scan: what was measured where, at which wavelength, with which uncertainty (`record.py`)."""

from clbrdf.scan.record import Scan, open_scans, save_scans

__all__ = ["Scan", "open_scans", "save_scans"]
