"""Figures to files, written whole or not at all."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path
from typing import TYPE_CHECKING, Any

from knotwork.errors import InputError
from knotwork.storage import write_file
from knotwork.view.style import settings

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SUFFIXES = (".png", ".svg", ".pdf")
PAGE_SUFFIXES = (".html", ".htm")
# Without the date, the same figure gives the same file.
_UNDATED: dict[str, dict[str, Any]] = {
    ".png": {},
    ".svg": {"Date": None},
    ".pdf": {"CreationDate": None},
}


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
        figure: What to write.
        path: The file; its folder is made if it does not exist. The suffix, `.png`, `.svg` or
            `.pdf`, says what is written.

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
