"""`python -m clbrdf.cli` is `clbrdf`."""

import sys

from clbrdf.cli import main

sys.exit(main())
