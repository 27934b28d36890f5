"""Sphinx: how the site is built (`make docs`)."""

from __future__ import annotations

import sys
from importlib.metadata import version as installed_version
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

project = "clbrdf"
author = "the authors of clbrdf"
copyright = "the authors of clbrdf, BSD-3-Clause"
version = release = installed_version("clbrdf")

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.intersphinx",
    "sphinx_copybutton",
    "drawn_pages",
]
source_suffix = {".md": "markdown"}
root_doc = "index"
exclude_patterns = ["build", "decisions/README.md"]
default_role = "code"
nitpicky = False

myst_enable_extensions = ["dollarmath", "deflist", "attrs_inline"]
myst_heading_anchors = 3
# A prompt is not part of a command, and what a command prints is not copied with it.
copybutton_prompt_text = r"\$ |>>> "
copybutton_prompt_is_regexp = True
copybutton_only_copy_prompt_lines = True

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False

# Links into other projects' pages are a help, not a condition: the site builds without a network.
intersphinx_mapping: dict[str, tuple[str, None]] = {}

html_theme = "furo"
html_title = f"clbrdf {release}"
html_show_sphinx = False
