"""Many scans at once, on Dask: one task a block of wavelengths, one whole file a scan."""
