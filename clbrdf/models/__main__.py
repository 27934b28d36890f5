"""Write the kernels of the pages of this package into a folder: python -m clbrdf.models kernels/models."""

from __future__ import annotations

import sys
from pathlib import Path

from clbrdf.models import tuned, written_kernel
from clbrdf.models.find import own_names


def main(folder: Path) -> None:
    """Write every file that differs; those of tuned models are written by hand and stay."""
    for name in own_names():
        if name in tuned.NAMES:
            continue
        path, text = folder / f"{name}.cl", written_kernel(name)
        if not path.is_file() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
            print(f"wrote {path}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
