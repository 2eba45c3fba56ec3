"""How the pages are built: ./fem docs."""

import re
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

import drawn_results
import reference_pages

import fem_reference

project = "fem_reference"
author = "the authors of fem_reference"
copyright = "2026, the authors of fem_reference"  # noqa: A001
release = version = fem_reference.__version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
source_suffix = {".md": "markdown"}
exclude_patterns = ["_build"]
myst_heading_anchors = 3
autodoc_typehints = "description"
autodoc_member_order = "bysource"
html_theme = "furo"
html_static_path = ["_static"]
html_css_files, html_js_files = ["house.css"], ["house.js"]
# Drawings name their colours, and are seen on dark paper in those that the pages of results have there.
html_theme_options = {"dark_css_variables": drawn_results.dark_colours()}
html_show_sourcelink = False
html_title = f"fem_reference {release}"


def fill(_app: Any, _page: str, source: list[str]) -> None:
    """What is generated in its places; files of the checkout, which are no pages, as their path."""
    text = drawn_results.fill(reference_pages.fill(source[0]))
    source[0] = re.sub(r"(?<!!)\[`?([^\]`]+)`?\]\(\.\./([^)#]+)\)", _path, text)


def _path(link: re.Match[str]) -> str:
    return f"`{link[2]}`" if link[1] in link[2] else f"{link[1]} (`{link[2]}`)"


def setup(app: Any) -> None:
    """Sphinx calls it."""
    app.connect("source-read", fill)
