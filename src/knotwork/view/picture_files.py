"""Figures as files, written whole or not at all, and as elements of a page."""

from __future__ import annotations

import contextlib
import io
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from knotwork.errors import InputError
from knotwork.storage import write_file
from knotwork.view.style import NIGHT, settings

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SUFFIXES = (".png", ".svg", ".pdf")
PAGE_SUFFIXES = (".html", ".htm")
# Without the date, the same figure gives the same file.
_UNDATED: dict[str, Any] = {".png": {}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}


def checked_picture_path(path: str | Path) -> Path:
    """Return the path of a picture to be written.

    Raises:
        InputError: Its suffix is none that can be written, or it can't be a file.
    """
    return _checked("a picture", path, SUFFIXES)


def checked_page_path(path: str | Path) -> Path:
    """Return the path of a page to be written.

    Raises:
        InputError: Its suffix is none that browsers show as a page, or it can't be a file.
    """
    return _checked("a page", path, PAGE_SUFFIXES)


def _checked(what: str, path: str | Path, suffixes: tuple[str, ...]) -> Path:
    """Return a path if a file of one of some suffixes may be there; its folder need not exist."""
    path = Path(path)
    reason = ""
    if path.suffix.lower() not in suffixes:
        found = f"the suffix is {path.suffix!r}" if path.suffix else "it has no suffix"
        reason = f"{found}; give {', '.join(suffixes)}"
    with contextlib.suppress(OSError, ValueError):  # these show when it is written
        above = next((folder for folder in path.parents if folder.exists()), None)
        if path.is_dir():
            reason = "it is a folder; give the path of a file"
        elif above is not None and not above.is_dir():
            reason = f"{above} is no folder"
    if reason:
        raise InputError(f"can't write {what} to {path}: {reason}")
    return path


def save_figure(figure: Figure, path: str | Path) -> Path:
    """Write a figure to a file, whole or not at all; an existing picture is replaced.

    Args:
        figure: To write.
        path: The file; its folder is made if it does not exist. The suffix, `.png`, `.svg` or
            `.pdf`, gives the format.

    Returns:
        The path.

    >>> from knotwork.view import plot_joints
    >>> save_figure(plot_joints(kw.plan("planar2_closed_form")), "joints.svg").name
    'joints.svg'

    Raises:
        InputError: The suffix is another, or the file can't be written.
    """
    path = checked_picture_path(path)
    suffix = path.suffix.lower()
    picture = io.BytesIO()
    with settings():
        figure.savefig(picture, format=suffix[1:], metadata=_UNDATED[suffix])
    return write_file(path, picture.getvalue(), what="a picture")


_METADATA = {"Date": None, "Creator": None, "Format": None, "Type": None}
_LEFT_OUT = re.compile(
    r"<!--.*?-->|<metadata>.*?</metadata>|<style.*?</style>|(?<=<g) id=\"(?!xtick)[^\":]*_\d+\"",
    re.DOTALL,
)
_PART = re.compile(r'(?<=<g) id="')
_SIZE = re.compile(r' (?:width|height)="[\d.]+pt"')
_COLOUR = re.compile(r": #([0-9a-f]{6})\b")


def inline_svg(figure: Figure) -> str:
    """Draw a figure as an element of HTML, without a size of its own.

    Colours that look different in the dark are variables: see `night_colours`. What has a name in
    the figure has it as `data-part`; names that Matplotlib makes are left out, but `xtick_…`.
    """
    file = io.StringIO()
    with settings():
        figure.savefig(file, format="svg", metadata=_METADATA)
    return inlined(file.getvalue())


def inlined(text: str) -> str:
    """Make the text of an SVG file an element of HTML, as `inline_svg` does."""
    named = _PART.sub(' data-part="', _LEFT_OUT.sub("", text[text.index("<svg") :]))
    head, tag, body = named.partition(">")
    body = _COLOUR.sub(lambda found: f": {_variable(found[1])}", body)
    return _SIZE.sub("", head) + tag + re.sub(r"\s*\n\s*", "\n", body)


def _variable(colour: str) -> str:
    return f"var(--plot-{colour}, #{colour})" if f"#{colour}" in NIGHT else f"#{colour}"


def night_colours() -> str:
    """Declarations of CSS with which pictures look as they are to look in the dark."""
    return " ".join(f"--plot-{day[1:]}: {night};" for day, night in NIGHT.items())
