"""Sphinx configuration."""

import sys
from importlib.metadata import version as installed_version
from pathlib import Path

from numpydoc.xref import DEFAULT_LINKS

import fingerslip

sys.path.insert(0, str(Path(__file__).parent / "_ext"))

project = "fingerslip"
author = "The fingerslip developers"
copyright = "2026, The fingerslip developers"  # noqa: A001  Sphinx wants this name
version = release = installed_version("fingerslip")

extensions = [
    "myst_parser",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx_design",
    "mathml",
    "notebooks",
]
html_math_renderer = "mathml"
myst_enable_extensions = ["dollarmath", "colon_fence", "deflist"]
myst_heading_anchors = 3
numpydoc_show_class_members = False
numpydoc_xref_param_type = True
# Types of ours are links; those of other libraries stay words.
numpydoc_xref_ignore = "all"
numpydoc_xref_aliases = {name: name for name in DEFAULT_LINKS} | {
    name: f"fingerslip.{name}" for name in fingerslip.__all__
}
autodoc_typehints = "none"
autodoc_member_order = "bysource"
maximum_signature_line_length = 88
templates_path = ["_templates"]
exclude_patterns = ["_build", "_ext", "_templates"]
html_theme = "furo"
html_static_path = ["_static"]
html_css_files = ["pages.css"]
html_js_files = ["copy.js"]
html_title = "fingerslip"


def setup(app):
    """Write a default that is made anew for each object as dots."""

    def shorten(_app, _what, _name, _thing, _options, signature, returned):
        return (signature or "").replace("<factory>", "...") or signature, returned

    app.connect("autodoc-process-signature", shorten)
