"""What tests in a browser share."""

from __future__ import annotations

import time


def comes_true(claim, patience=20.0):
    """Whether a claim about the page comes true, given some time."""
    end = time.monotonic() + patience
    while not claim():
        if time.monotonic() > end:
            return False
        time.sleep(0.05)
    return True
