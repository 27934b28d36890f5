"""Values of a scan looked up by direction."""

from __future__ import annotations

import numpy as np


def at(scan, theta_i, theta_r, phi, column=0):
    """The values in directions near to one."""
    turn = np.abs(np.mod(scan.phi - phi + 180.0, 360.0) - 180.0)
    near = (np.abs(scan.theta_i - theta_i) < 0.01) & (np.abs(scan.theta_r - theta_r) < 0.01)
    near &= (turn < 0.01) | (np.minimum(theta_r, 180.0 - theta_r) == 0.0)
    assert near.any(), (theta_i, theta_r, phi)
    return scan.brdf[near, column]
