"""Settings of Sphinx: `scripts/env.sh sphinx-build -b html docs out/docs`."""

import sys
from pathlib import Path

for package in sorted((Path(__file__).resolve().parent.parent / "src").glob("intent_*")):
    sys.path.insert(0, str(package))

project = "Intent"
author = "Intent maintainers"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
source_suffix = {".md": "markdown"}
myst_heading_anchors = 3
# Names of tables and modules that documents mention lie outside docs/.
suppress_warnings = ["myst.xref_missing", "toc.not_included"]
autodoc_typehints = "none"
autodoc_member_order = "bysource"
html_theme = "alabaster"
html_theme_options = {"page_width": "1100px", "sidebar_width": "230px"}
