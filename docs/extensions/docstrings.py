"""What docstrings say in shorter ways than reStructuredText knows.

An indented block after a blank line is a formula or code, shown as it is; several names before one
colon share a description; what is returned has its type in the signature, so that a colon in it is
part of a sentence. Click's unwrapped lines are tables, shown as they are.
"""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx

from knotwork.files.documents import StrictModel

HIDDEN = "\x1f"


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip())


def _compiles(lines: list[str]) -> bool:
    width = min(_indent(line) for line in lines if line.strip())
    try:
        compile("\n".join(line[width:] for line in lines), "<docstring>", "exec")
    except SyntaxError:
        return False
    return True


def show_blocks(_app: Any, _what: str, _name: str, _obj: Any, _opt: Any, lines: list[str]) -> None:
    """Mark indented blocks as literal ones, before Napoleon reads the sections."""
    i, before = 1, lines[0] if lines else ""
    while i < len(lines):
        line = lines[i]
        if not line.strip():
            i += 1
            continue
        block = not lines[i - 1].strip() and _indent(line) >= _indent(before) + 4
        if not block or re.match(r"\s*([*-]|\d+\.|\.\.) ", before):
            before = line
            i += 1
            continue
        end = i
        while end < len(lines) and (not lines[end].strip() or _indent(lines[end]) >= _indent(line)):
            end += 1
        language = "python" if _compiles(lines[i:end]) else "none"
        lines[i:i] = [" " * _indent(before) + f".. code-block:: {language}", ""]
        i = end + 2
        if i < len(lines):
            before = lines[i]


def split_names(_app: Any, _what: str, _name: str, _obj: Any, _opt: Any, lines: list[str]) -> None:
    """Give each of several names a field of its own, after Napoleon has made the fields."""
    for i in range(len(lines) - 1, -1, -1):
        found = re.match(r":(ivar|raises|param) ([\w.]+(?:, [\w.]+)+): ?(.*)", lines[i])
        if found is None:
            continue
        end = i + 1
        while end < len(lines) and (_indent(lines[end]) > 0 or not lines[end].strip()):
            end += 1
        rest = [line for line in lines[i + 1 : end] if line.strip()]
        lines[i:end] = [
            text
            for name in found[2].split(", ")
            for text in (f":{found[1]} {name}: {found[3]}", *rest)
        ] + [""] * (end < len(lines) and not lines[end - 1].strip())


def list_fields(_app: Any, what: str, _name: str, obj: Any, _opt: Any, lines: list[str]) -> None:
    """List the fields of a part of a file as its parameters, with their units."""
    if what != "class" or not issubclass(obj, StrictModel):
        return
    place = next((i for i, line in enumerate(lines) if line.startswith(":raises")), len(lines))
    for name, field in reversed(obj.model_fields.items()):
        left_out = "; required" if field.is_required() else ""
        if field.default and isinstance(field.default, str | float | int):
            left_out = f"; default: ``{field.default!r}``"
        lines.insert(place, f":param {name}: {field.description}{left_out}")


def hide_colons(_app: Any, _what: str, _name: str, _obj: Any, _opt: Any, lines: list[str]) -> None:
    """Keep Napoleon from taking the start of a sentence after `Returns:` for a type."""
    inside = False
    for i, line in enumerate(lines):
        if line.strip() and _indent(line) == 0:
            inside = line.strip() == "Returns:"
        elif inside:
            lines[i] = line.replace(":", HIDDEN)


def show_colons(_app: Any, _what: str, _name: str, _obj: Any, _opt: Any, lines: list[str]) -> None:
    """Undo `hide_colons`."""
    lines[:] = [line.replace(HIDDEN, ":") for line in lines]


def show_tables(_app: Any, _context: Any, lines: list[str]) -> None:
    """Turn the line blocks that sphinx-click makes of unwrapped lines into literal ones."""
    for i in range(len(lines) - 1, -1, -1):
        if not lines[i].startswith("| "):
            continue
        lines[i] = "    " + lines[i][2:]
        if i == 0 or not lines[i - 1].startswith("| "):
            lines[i:i] = ["", ".. code-block:: none", ""]


def hide_private(signature: str) -> str:
    """Leave out the parameters that begin with an underscore, which a dataclass may have last."""
    found = re.search(r",? ?(\*, )?\b_[a-z]\w*: ", signature) if signature else None
    return signature[: found.start()] + ")" if found else signature


def name_aliases(
    _app: Any, _what: str, _name: str, _obj: Any, _opt: Any, signature: str, returned: str
) -> tuple[str, str]:
    """Show the names of types that stand for long unions; Sphinx shows what it holds them in."""

    def named(text: str) -> str:
        # a default that is made anew each time is no Python, which Sphinx would not set as such
        text = text.replace("<factory>", "...") if text else text
        return re.sub(r"TypeAliasForwardRef\('(\w+)'\)", r"\1", text) if text else text

    return named(hide_private(signature)), named(returned)


def hide_borrowed(_app: Any, what: str, _name: str, obj: Any, _opt: Any, lines: list[str]) -> None:
    """Leave out what the type of a constant says of itself."""
    said = (type(obj).__doc__ or "").strip().partition("\n")[0]
    if what == "data" and said and lines and lines[0].strip() == said:
        lines.clear()


def skip_fields(
    _app: Any, _what: str, _name: str, obj: Any, skip: bool, _options: Any
) -> bool | None:
    """Leave out the fields of named tuples, which their class describes."""
    return True if (getattr(obj, "__doc__", "") or "").startswith("Alias for field") else None


def show_dashes(_app: Any, doctree: nodes.document) -> None:
    """Set the dash between a parameter and its description, which Sphinx writes as two hyphens."""
    for text in list(doctree.findall(nodes.Text)):
        if text == " -- ":
            text.parent.replace(text, nodes.Text(" – "))


def setup(app: Sphinx) -> dict[str, bool]:
    """Hook all in, before Napoleon and after it."""
    app.connect("autodoc-process-docstring", show_blocks, priority=400)
    app.connect("autodoc-process-docstring", hide_colons, priority=450)
    app.connect("autodoc-process-docstring", show_colons, priority=550)
    app.connect("autodoc-process-docstring", split_names, priority=600)
    app.connect("autodoc-process-docstring", list_fields, priority=650)
    app.connect("autodoc-process-docstring", hide_borrowed, priority=300)
    app.connect("autodoc-skip-member", skip_fields)
    app.connect("autodoc-process-signature", name_aliases)
    app.connect("doctree-read", show_dashes)
    app.connect("sphinx-click-process-description", show_tables)
    app.connect("sphinx-click-process-epilog", show_tables)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
