"""Fitting a model to a scan at every wavelength: one method a file."""
