"""Pictures that are SVG become a part of their page, in its colours: light or dark."""

from __future__ import annotations

import html
from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx

from knotwork.view.picture_files import inline_svg_text, night_colours

NIGHT = (  # the theme's choice of the dark, and the browser's
    f'<style>body[data-theme="dark"] .drawing {{ {night_colours()} }}\n'
    "@media screen and (prefers-color-scheme: dark) "
    f'{{ body:not([data-theme="light"]) .drawing {{ {night_colours()} }} }}</style>'
)


def drawing(file: Path, words: str) -> nodes.raw:
    """A picture as a part of a page.

    Args:
        file: SVG as Matplotlib writes it.
        words: What it shows.
    """
    picture = inline_svg_text(file.read_text(encoding="utf-8"))
    label = html.escape(words)
    element = f'<div class="drawing" role="img" aria-label="{label}">{picture}</div>'
    return nodes.raw("", f"{NIGHT}\n{element}\n", format="html")


def draw(app: Sphinx, document: nodes.document) -> None:
    """Put each picture that is a paragraph of its own into the page itself."""
    for picture in list(document.findall(nodes.image)):
        around = picture.parent
        if picture["uri"].endswith(".svg") and len(around) == 1:
            app.env.note_dependency(picture["uri"])
            around.replace_self(drawing(Path(app.srcdir) / picture["uri"], picture.get("alt", "")))


def setup(app: Sphinx) -> dict[str, bool]:
    """Follow the build's pictures."""
    app.connect("doctree-read", draw)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
