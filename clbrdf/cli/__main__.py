"""`python -m clbrdf.cli` is `clbrdf`."""

import sys

from clbrdf_start import main

sys.exit(main())
