"""The version of the package, as files and workers tell it."""

__version__ = "0.2.0"
