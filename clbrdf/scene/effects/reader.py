"""The reader's personal error: different people read different values.

    f · (1 + percent / 100 · z),     z standard normal, for each value, each direction, or the scan as a whole

Source: equation (3) of Wang, Zhang and Dong (2013): ε_PE = 4.84 %.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from clbrdf.storage.tomlfile import TomlTable


class Reader(TomlTable):
    """Settings.

    Attributes
    ----------
    percent : float
        Standard deviation, % of the value.
    each : "value", "direction" or "scan"
        What one reading is: who reads value by value errs anew each time, one reader of a scan errs once.
    """

    percent: Annotated[float, Field(ge=0.0, lt=100.0)] = 4.84
    each: Literal["value", "direction", "scan"] = "value"
