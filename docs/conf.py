# What sphinx-build reads: `make docs`, or
#     .venv/bin/sphinx-build -W --keep-going -b html docs docs/_build/html
# Nothing on the pages is fetched from elsewhere.

import sys
from pathlib import Path

_HERE = Path(__file__).parent
sys.path[:0] = [str(_HERE / "_ext"), str(_HERE.parent / "src")]

from asperity._version import __version__  # noqa: E402

project = "asperity"
author = "asperity developers"
project_copyright = author
release = version = __version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "docstrings",
    "ledger",
    "mathml",
    "notebooks",
    "offline",
    "parameter_tables",
]
exclude_patterns = ["_build", "_ext", "images"]

# --- Pages ---------------------------------------------------------------------------------------
myst_enable_extensions = ["deflist", "dollarmath"]
myst_heading_anchors = 3
# A text with a unit is no reference of numpydoc's.
default_role = "code"
# Quotation marks only: two hyphens are an option of a command.
smartquotes_action = "q"

# --- API -----------------------------------------------------------------------------------------
autodoc_member_order = "bysource"
# Types stand in the docstrings, with shapes and units.
autodoc_typehints = "none"
autodoc_default_options = {"members": True}
autodoc_preserve_defaults = True
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True
napoleon_custom_sections = [("Class attributes", "Attributes")]
add_module_names = False

# --- Looks ---------------------------------------------------------------------------------------
html_theme = "furo"
html_title = f"asperity {release}"
html_math_renderer = "mathml"
html_show_sourcelink = False
html_copy_source = False
html_static_path = ["_static"]
html_css_files = ["pages.css"]
pygments_style = "friendly"
pygments_dark_style = "monokai"

# Attributes of one name in several records, such as mu1: napoleon links types by their bare name,
# and there is nothing to choose between.
suppress_warnings = ["ref.python"]
