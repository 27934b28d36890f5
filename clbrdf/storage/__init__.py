"""Files: written whole or not at all, HDF5 and TOML looked at before they are believed, units."""
