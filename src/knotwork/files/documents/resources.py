"""The robots and scenarios shipped with the package, found by name.

In a checkout they are the top-level folders `robots/` and `scenarios/`; in an installed package
they are inside it.
"""

from __future__ import annotations

import os
from pathlib import Path

from knotwork.errors import InputError, UnknownNameError

_PACKAGE_FOLDER = Path(__file__).resolve().parents[2]


def folder(kind: str) -> Path:
    """Folder of the shipped files of a kind, `"robots"` or `"scenarios"`."""
    installed = _PACKAGE_FOLDER / "_data" / kind
    return installed if installed.is_dir() else _PACKAGE_FOLDER.parents[1] / kind


def names(kind: str) -> list[str]:
    """Names of the shipped files of a kind, `"robots"` or `"scenarios"`, sorted."""
    return sorted(path.stem for path in folder(kind).glob("*.yaml"))


def is_path(reference: str | Path) -> bool:
    """Whether a reference is a path.

    A path has a dot or a path separator, and a name has neither.
    """
    return isinstance(reference, Path) or any(mark in reference for mark in "./\\")


def find(kind: str, reference: str | Path) -> Path:
    """Find a shipped file by name, or any file by path.

    Args:
        kind: `"robots"` or `"scenarios"`.
        reference: Name or path.

    Raises:
        UnknownNameError: No file of this name is shipped.
        InputError: No file exists at the path.
    """
    text = str(reference)
    if is_path(reference):
        path = Path(os.path.expanduser(text))
        if os.path.isdir(path):
            raise InputError(f"{text} is a folder; give the path of one {kind[:-1]} file in it")
        if not os.path.exists(path):
            listed = ", ".join(names(kind))
            raise InputError(
                f"there is no file {text}; give the path of a {kind[:-1]} file or one of these "
                f"names: {listed}"
            )
        return path
    known_names = names(kind)
    if text not in known_names:
        raise UnknownNameError(kind[:-1], text, known_names)
    return folder(kind) / f"{text}.yaml"
