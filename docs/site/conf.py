# SPDX-License-Identifier: Apache-2.0
"""Sphinx's settings. What it reads is what stage.py has written."""
project = "Meltstage"
author = "Meltstage"
html_title = "Meltstage"
extensions = ["myst_parser"]
source_suffix = {".md": "markdown"}
root_doc = "index"
myst_heading_anchors = 6          # links to headings, by the names that code hosts give them
suppress_warnings = ["misc.highlighting_failure"]  # blocks are parsed by tests/docs/blocks.py
html_theme = "furo"
html_theme_options = {"top_of_page_button": None}
html_copy_source = False
html_show_sphinx = False
html_show_copyright = False
html_permalinks_icon = "#"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_last_updated_fmt = None
