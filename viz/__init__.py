"""Pictures: lobes, spectra, fits."""
