"""A figure as SVG that is a part of a page, in colours that the page can change for the dark."""

from __future__ import annotations

import io
import re
from typing import TYPE_CHECKING

from knotwork.view.style import NIGHT, settings

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_METADATA = {"Date": None, "Creator": None, "Format": None, "Type": None}
_LEFT_OUT = re.compile(
    r"<!--.*?-->|<metadata>.*?</metadata>|<style.*?</style>|(?<=<g) id=\"[^\"]*\"", re.DOTALL
)
_SIZE = re.compile(r' (?:width|height)="[\d.]+pt"')
_COLOUR = re.compile(r": #([0-9a-f]{6})\b")


def inline_svg(figure: Figure) -> str:
    """Draw a figure as an element of HTML, without a size of its own.

    Colours that look different in the dark are variables: see `night_colours`. Names that the
    figure gives its parts are left out.
    """
    file = io.StringIO()
    with settings():
        figure.savefig(file, format="svg", metadata=_METADATA)
    return inlined(file.getvalue())


def inlined(text: str) -> str:
    """Make the text of an SVG file an element of HTML, as `inline_svg` does."""
    head, tag, body = _LEFT_OUT.sub("", text[text.index("<svg") :]).partition(">")
    body = _COLOUR.sub(lambda found: f": {_variable(found[1])}", body)
    return _SIZE.sub("", head) + tag + re.sub(r"\s*\n\s*", "\n", body)


def _variable(colour: str) -> str:
    return f"var(--plot-{colour}, #{colour})" if f"#{colour}" in NIGHT else f"#{colour}"


def night_colours() -> str:
    """Declarations of CSS with which pictures look as they are to look in the dark."""
    return " ".join(f"--plot-{day[1:]}: {night};" for day, night in NIGHT.items())
