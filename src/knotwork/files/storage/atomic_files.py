"""Atomic file writing: into a hidden folder first, then moved into place."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path

from knotwork.errors import InputError

_HIDDEN = ".knotwork-"
"""Prefix of the hidden folder's name."""


def write_files(folder: Path | str, contents: Mapping[str, str | bytes]) -> list[Path]:
    """Write files into a folder, each as a whole; existing ones are replaced.

    If one can't be written, none is. A process that ends while files are moved into place leaves
    old ones next to new ones, which `changed_since_report` detects.

    >>> [path.name for path in write_files("motion", {"a.txt": "one", "b.bin": b"two"})]
    ['a.txt', 'b.bin']

    Args:
        folder: Created if it does not exist.
        contents: Text, written in UTF-8, or bytes by file name.

    Returns:
        Paths of the files.

    Raises:
        InputError: The folder can't be made or written to.
    """
    with _refusing(f"can't write to {folder}", "give a folder that can be made and written to"):
        return _write(Path(folder), contents)


def write_file(
    path: Path | str, content: str | bytes, *, kind: str = "", replace: bool = True
) -> Path:
    """Write one file, whole or not at all; an existing one is replaced.

    >>> write_file("motion/a.txt", "one").read_text()
    'one'

    Args:
        path: Path of the file; its folder is created if it does not exist.
        content: Text, written in UTF-8, or bytes.
        kind: Kind of content, for the error, such as `"a picture"`.
        replace: Whether an existing file is replaced; else it is an error, so that only one of
            several writers succeeds.

    Raises:
        InputError: The file can't be written.
    """
    path = Path(path)
    accepted = "give a file in a folder that can be made and written to"
    with _refusing(f"can't write {kind + ' ' if kind else ''}to {path}", accepted):
        return _write(path.parent, {path.name: content}, replace)[0]


@contextlib.contextmanager
def _refusing(failure: str, accepted: str) -> Iterator[None]:
    """Turn an error of the file system into one of input: failure, reason, accepted input.

    Raises:
        InputError: An `OSError`, or a `ValueError` for a name or text that no file can have.
    """
    try:
        yield
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{failure}: {reason}; {accepted}") from error


def _write(folder: Path, contents: Mapping[str, str | bytes], replace: bool = True) -> list[Path]:
    """Write files into a hidden folder, then move them into place.

    Raises:
        OSError: A file could not be written.
        ValueError: A name or text can't be stored in a file.
    """
    folder.mkdir(parents=True, exist_ok=True)
    if not replace and any((folder / name).exists() for name in contents):
        raise FileExistsError(None, "it exists already")
    with tempfile.TemporaryDirectory(prefix=_HIDDEN, dir=folder) as hidden:
        for name, content in contents.items():
            _write_one(Path(hidden, name), content, folder / name)
        for name in contents:
            if not replace:  # this takes the name before another writer can
                (folder / name).open("xb").close()
            os.replace(Path(hidden, name), folder / name)
    return [folder / name for name in contents]


def _write_one(path: Path, content: str | bytes, target: Path) -> None:
    """Write a hidden file, with the permissions of the one that it will replace."""
    if target.is_dir():
        raise IsADirectoryError(None, f"{target.name} is a folder")
    with path.open("xb") as file:
        if target.exists():
            shutil.copymode(target, path)
        file.write(content if isinstance(content, bytes) else content.encode())
        file.flush()
        os.fsync(file.fileno())
