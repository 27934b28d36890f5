"""Conventions of a file, looked at in its data before they are believed.

`decide` turns a reading into a scan. What a file or its format says is held against what the data can tell;
where both agree, or the data cannot tell, what is said holds. Where they disagree, or nothing is said and two
readings fit, an error names the option that decides. Nothing is turned, scaled or divided without a word.
"""

from clbrdf.formats.guard.decide import decide
from clbrdf.formats.guard.options import Decision, Options

__all__ = ["Decision", "Options", "decide"]
