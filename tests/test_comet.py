"""Other people's program reads the components: obsarray of the CoMET toolkit, in an environment of its own.

It is no dependency and never imported here; `make soak` installs it into build/comet, and without that this
test is skipped.
"""

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

from clbrdf.scan import Component, Correlation
from tests.test_components import covariance, make_scan

PYTHON = Path(__file__).parent.parent / "build" / "comet" / "bin" / "python"

READER = """
import json, sys, warnings
warnings.simplefilter("ignore")
import obsarray, xarray
data = xarray.open_dataset(sys.argv[1], group="entry/data", engine="netcdf4")
found = data.unc["brdf"]
print(json.dumps({
    "names": list(found.keys()),
    "covariances": [found[name].err_cov_matrix().values.tolist() for name in found.keys()],
    "total": found.total_err_cov_matrix().values.tolist(),
    "random": [bool(found[name].is_random) for name in found.keys()],
}))
"""


@pytest.mark.skipif(
    not PYTHON.exists(), reason="obsarray is not installed in build/comet (make soak does it)"
)
def test_obsarray_reads_the_covariance_of_every_component(tmp_path):
    random, systematic = Correlation("random"), Correlation("systematic")
    components = (
        Component("noise", 0.01, True, random, systematic, random),
        Component("panel", 0.02, wavelength=Correlation("bell", width=30.0)),
        Component("alignment", np.linspace(-0.01, 0.02, 18).reshape(6, 3), False, systematic, random),
        Component("dark", 0.001, False, Correlation("groups", groups=[0, 0, 0, 1, 1, 1])),
        Component("lamp", 0.01, direction=Correlation("bell", width=40.0), wavelength=random),
        Component("scale", 0.03),
    )
    scan = make_scan(components=components)
    scan.save(tmp_path / "scan.h5")
    run = subprocess.run(
        [PYTHON, "-c", READER, tmp_path / "scan.h5"], capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr
    told = json.loads(run.stdout)
    assert told["names"] == ["u_noise", "u_panel", "u_alignment", "u_dark", "u_lamp", "u_scale"]
    assert told["random"] == [True, False, False, False, False, False]
    expected = [covariance(scan, one) for one in scan.components]
    for found, one in zip(told["covariances"], expected, strict=True):
        # The correlations are stored as numbers, the sizes as percentages: a few roundings.
        np.testing.assert_allclose(found, one, rtol=1e-12, atol=1e-18)
    np.testing.assert_allclose(told["total"], sum(expected), rtol=1e-12, atol=1e-18)
