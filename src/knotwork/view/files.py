"""Figures to files, written whole or not at all."""

from __future__ import annotations

import contextlib
import io
import os
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from knotwork.errors import InputError
from knotwork.view.style import settings

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SUFFIXES = (".png", ".svg", ".pdf")
# Without the date, the same figure gives the same file.
_UNDATED: dict[str, dict[str, Any]] = {
    ".png": {},
    ".svg": {"Date": None},
    ".pdf": {"CreationDate": None},
}


def checked_picture_path(path: str | Path) -> Path:
    """Return the path of a picture to be written.

    Raises:
        InputError: Its suffix is none that can be written, its folder does not exist, or it is a
            folder itself.
    """
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        found = f"the suffix is {path.suffix!r}" if path.suffix else "it has no suffix"
        raise InputError(f"can't write a picture to {path}: {found}; give {', '.join(SUFFIXES)}")
    reason = ""
    with contextlib.suppress(OSError, ValueError):  # these show when it is written
        if path.is_dir():
            reason = "it is a folder; give the path of a file"
        elif not path.parent.exists():
            reason = f"there is no folder {path.parent}; make it first"
        elif not path.parent.is_dir():
            reason = f"{path.parent} is no folder"
    if reason:
        raise InputError(f"can't write a picture to {path}: {reason}")
    return path


def save_figure(figure: Figure, path: str | Path) -> Path:
    """Write a figure to a file, whole or not at all; an existing picture is replaced.

    Args:
        figure: What to write.
        path: The file. Its suffix, `.png`, `.svg` or `.pdf`, says what is written.

    Returns:
        The path.

    Raises:
        InputError: The suffix is another, or the file can't be written.
    """
    path = checked_picture_path(path)
    suffix = path.suffix.lower()
    picture = io.BytesIO()
    with settings():
        figure.savefig(picture, format=suffix[1:], metadata=_UNDATED[suffix])
    temporary: Path | None = None
    try:
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=".knotwork-", suffix=suffix)
        temporary = Path(name)
        with os.fdopen(handle, "wb") as file:
            file.write(picture.getvalue())
        temporary.chmod(0o666 & ~_umask())
        os.replace(temporary, path)
    except (OSError, ValueError) as error:  # ValueError: a name that no file can have
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(
            f"can't write a picture to {path}: {reason}; give a file that can be written"
        ) from error
    finally:
        if temporary is not None:
            temporary.unlink(missing_ok=True)
    return path


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
