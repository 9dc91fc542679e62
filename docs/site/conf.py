# SPDX-License-Identifier: Apache-2.0
"""Sphinx's settings. What it reads is what stage.py has written."""
import pathlib
import re

import furo

project = "Meltstage"
author = "Meltstage"
html_title = "Meltstage"
extensions = ["myst_parser"]
source_suffix = {".md": "markdown"}
root_doc = "index"
myst_heading_anchors = 6          # links to headings, by the names that code hosts give them
suppress_warnings = ["misc.highlighting_failure"]  # blocks are parsed by tests/docs/blocks.py
html_theme = "furo"
# Debian's build of the style has the dark colours for who chooses them, and not for a browser that asks for dark.
STYLE = (pathlib.Path(furo.__file__).parent / "theme/furo/static/styles/furo.css").read_text(encoding="utf-8")
DARK = re.search(r'body\[data-theme="dark"\] \{(.*?)\}', STYLE, re.DOTALL)[1]
html_theme_options = {"top_of_page_button": None, "dark_css_variables": dict(re.findall(r"--([\w-]+): ([^;]+);", DARK))}
html_copy_source = False
html_show_sphinx = False
html_show_copyright = False
html_permalinks_icon = "#"
html_static_path = ["_static"]
html_css_files = ["site.css"]
