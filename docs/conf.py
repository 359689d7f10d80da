"""How the documentation is built: `make docs`. Nothing here needs a network."""

from __future__ import annotations

import importlib
import logging
import os
import sys
from pathlib import Path

import click

import knotwork
import knotwork.cli.progress_display
from knotwork.cli.main import cli

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE / "extensions"))
# The highlighting style sets up logging when it is imported, if nobody has.
logging.getLogger().addHandler(logging.NullHandler())
os.environ["COLUMNS"] = "96"  # the width of what commands print
knotwork.cli.progress_display.PLAN_INTERVAL = 1e6  # and how slow the machine is does not matter

# Each command is loaded when it is asked for, and sphinx_click takes what it finds.
cli.commands.update({name: cli.get_command(click.Context(cli), name) for name in cli.commands})

project = "Knotwork"
author = "the Knotwork authors"
copyright = author
version = release = knotwork.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_click",
    "docstrings",
    "drawings",
    "gallery",
    "links",
    "mathml",
    "schema_tables",
    "shown",
]
exclude_patterns = ["extensions", "templates"]
templates_path: list[str] = []

# The notebook is run while its page is built. Sphinx reads nothing outside this folder.
notebook = (HERE.parent / "examples" / "method.ipynb").read_bytes()
if not (HERE / "notebook.ipynb").is_file() or (HERE / "notebook.ipynb").read_bytes() != notebook:
    (HERE / "notebook.ipynb").write_bytes(notebook)
# So are the pages of benchmarks, from what was measured.
sys.path.append(str(HERE.parent / "benchmarks"))
pages = importlib.import_module("pages")
for page in pages.PAGES:
    if page.endswith("_benchmarks"):
        pages.write(page)
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 900  # it ends what never does, on a slow machine too [s]
nb_merge_streams = True

myst_enable_extensions = ["dollarmath", "deflist", "colon_fence"]
myst_heading_anchors = 3
suppress_warnings = ["ref.python"]  # parts of tasks and of scenarios share names

smartquotes_action = "qe"  # quotes and ellipses, but an option's -- stays
default_role = "named"  # single backticks in docstrings: a link if it is a public name, else code
autodoc_default_options = {"members": True}
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_type_aliases = {
    name: name
    for name in ("ArrayLike", "FloatArray", "BoolArray", "EndAccelerationLike", "AnyMotion")
}
autodoc_class_signature = "mixed"
autodoc_preserve_defaults = True
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
maximum_signature_line_length = 88
python_use_unqualified_type_names = True
add_module_names = False

nitpicky = True
# What types in signatures may name without being on a page of this site.
nitpick_ignore_regex = [
    # Of Python and of other packages: no build step may fetch their indexes from the network.
    (r"py:.*", r"(numpy|np|scipy|pin|pinocchio|matplotlib|meshcat|pydrake|click|yaml)\..*"),
    (r"py:.*", r"(collections|collections\.abc|pathlib|typing|types|enum|fractions)\..*"),
    (r"py:.*", r"(bool|bytes|dict|float|frozenset|int|list|object|str|tuple|type|None)"),
    (r"py:.*", r"(Any|Callable|Iterable|Iterator|Literal|Mapping|Path|Sequence|TypeAlias|Unpack)"),
    (r"py:.*", r"(Exception|AssertionError|ValueError|ArrayLike|Figure|PPoly|optional)"),
    # Parts that callers never name: a file as it was read, what a robot is made of, a union of
    # types that its description spells out.
    (
        r"py:.*",
        r"(knotwork\.[\w.]+\.)?(Document|Locations|RobotSpec|VirtualJoint|AnyMotion|CheckedMotion|"
        r"Findings|Subject|TaskFrame|ToolMotion|ExtendedCurve|TorchRanges|PathTrack|ExpandedTask|LoadedRobots|"
        r"KnotPlacement|EndAcceleration(Like)?|Status|ObstructionCause|JointTree|WeavePattern|Window|StudyFolder|Outcome|"
        r"FeasibleDurations|TimedCurve)",
    ),
    # Arrays of NumPy under shorter names.
    (r"py:.*", r"(knotwork\.[\w.]+\.)?(FloatArray|BoolArray)"),
]

html_theme = "furo"
html_title = f"Knotwork {version}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_js_files = ["site.js"]
html_search_scorer = str(HERE / "extensions" / "scorer.js")
html_show_sphinx = False
html_copy_source = False
html_show_sourcelink = False
html_math_renderer = "mathml"
html_theme_options = {"navigation_with_keys": True}
pygments_style = "a11y-high-contrast-light"
pygments_dark_style = "a11y-high-contrast-dark"
