"""How the documentation is built: `make docs`. Nothing is fetched and no notebook is executed."""

import os
import re
import shutil
from importlib.metadata import version as version_of
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
# The reference imports every module it describes; plots must not look for a screen.
os.environ.setdefault("MPLBACKEND", "Agg")


def _copy_notebooks() -> None:
    """Put the notebooks, with their stored outputs, where Sphinx finds them; `docs/notebooks` is not tracked."""
    target = HERE / "notebooks"
    target.mkdir(exist_ok=True)
    there = {file.name: file for file in (HERE.parent / "notebooks").glob("*.ipynb")}
    for old in target.glob("*.ipynb"):
        if old.name not in there:
            old.unlink()
    for name, file in there.items():
        copy = target / name
        if not copy.exists() or copy.read_bytes() != file.read_bytes():
            shutil.copyfile(file, copy)


_copy_notebooks()

project = "drivetwin"
author = "the drivetwin authors"
release = version_of("drivetwin")
version = release
language = "en"

extensions = ["sphinx.ext.autodoc", "sphinx.ext.autosummary", "sphinx.ext.napoleon", "myst_nb"]
exclude_patterns = ["examples", "_templates", "**/.ipynb_checkpoints"]
templates_path = ["_templates"]

nb_execution_mode = "off"
nb_merge_streams = True
myst_enable_extensions = ["colon_fence", "deflist", "fieldlist"]
myst_heading_anchors = 3
# Links from pages to files of the repository are those that a reader of the repository follows.
suppress_warnings = ["mystnb.unknown_mime_type", "myst.header"]

autosummary_generate = True
autosummary_imported_members = False
autodoc_member_order = "bysource"
autodoc_typehints = "none"
autodoc_inherit_docstrings = False
autodoc_preserve_defaults = True
autodoc_class_signature = "mixed"
autodoc_default_options = {"members": True}
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True
add_module_names = False
python_use_unqualified_type_names = True
toc_object_entries_show_parents = "hide"

default_role = "code"
_SIDE = ["sidebar-nav-bs"]
html_theme = "pydata_sphinx_theme"
html_title = "drivetwin"
html_static_path = ["_static"]
html_css_files = ["drivetwin.css"]
html_copy_source = False
html_show_sourcelink = False
html_sidebars = {"*": [], "api/**": _SIDE, "notebooks/**": _SIDE, "papers/**": _SIDE}
html_theme_options = {
    "navigation_with_keys": False,
    "show_toc_level": 1,
    "navbar_align": "left",
    "header_links_before_dropdown": 8,
    "footer_start": [],
    "footer_end": [],
    "secondary_sidebar_items": ["page-toc"],
    "pygments_light_style": "friendly",
    "pygments_dark_style": "monokai",
}

# Docstrings are plain text with Google's sections. Bars, stars and trailing underscores in their formulas are markup to
# Sphinx and are escaped; code between single quotes of the other kind becomes code.
_SPAN = re.compile(r"``.+?``|`[^`\n]+`")
_fields: dict[str, list[str]] = {}
_NAME = re.compile(r"`[A-Za-z_][\w.]*`")


def _as_code(span: str) -> str:
    return span if span.startswith("``") or _NAME.fullmatch(span) else f"`{span}`"


def _plain_line(line: str) -> str:
    found, end = [], 0
    for match in _SPAN.finditer(line):
        found += [_escaped(line[end : match.start()]), _as_code(match.group())]
        found += ["\\ "] if line[match.end() : match.end() + 1].isalnum() else []
        end = match.end()
    return "".join([*found, _escaped(line[end:])])


def _escaped(text: str) -> str:
    text = re.sub(r"([|*])", r"\\\1", text)
    return re.sub(r"(?<=\w)_(?!\w)", r"\\_", text)


def _plain(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    whole = "\n".join(lines)
    # A span of code may go over the end of a line.
    whole = re.sub(r"(?<!`)`([^`]+)`(?!`)", lambda m: "`" + " ".join(m.group(1).split()) + "`", whole)
    lines[:] = [line if line.startswith("    ") and "::" in whole else _plain_line(line) for line in whole.split("\n")]
    _fields[name] = list(lines)


def _as_it_was(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    # Napoleon takes what stands before the first colon of a field's text for its type.
    if what in ("attribute", "property", "data"):
        lines[:] = [*_fields[name], ""]


def _to_copies(app: Any, page: str, source: list[str]) -> None:
    # In the repository pages lead to the notebooks themselves, here to the copies.
    source[0] = source[0].replace("](../notebooks/", "](notebooks/").replace("](../../notebooks/", "](../notebooks/")


def setup(app: Any) -> None:
    """Called by Sphinx."""
    app.connect("source-read", _to_copies)
    app.connect("autodoc-process-docstring", _plain, priority=400)  # before napoleon reads the sections
    app.connect("autodoc-process-docstring", _as_it_was, priority=600)
