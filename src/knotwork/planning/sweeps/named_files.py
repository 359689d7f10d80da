"""Files that a scenario depends on: those that it names, and those that they name."""

from __future__ import annotations

import contextlib
import hashlib
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from knotwork.errors import InputError
from knotwork.files.documents import read, read_text
from knotwork.scene.meshes.locating import find_mesh
from knotwork.task.task_source import texts_in

MAX_NAMED_FILE_BYTES = 500_000_000
"""Maximum size of a named file [bytes]. No reader accepts more, and a text may name any file."""
_DOCUMENTS = (".yaml", ".yml", ".json")
_MESH = re.compile(r"""filename\s*=\s*["']([^"']+)["']""")


def named_files(data: Any, folder: Path) -> dict[str, Path]:
    """Find all files named by texts in data, and the files that robots and URDFs among them name.

    Args:
        data: Plain data: mappings, sequences, texts.
        folder: Folder of relative paths.

    Returns:
        Paths by name, sorted; the name of a file named in another one begins with that one's.
    """
    files: dict[str, Path] = {}
    _add(files, "", ((text, folder / text) for _, text in texts_in(data)))
    return dict(sorted(files.items()))


def file_digests(data: Any, folder: Path) -> dict[str, str]:
    """SHA-256 of the files that `named_files` finds, by the same names."""
    digests = {}
    for name, path in named_files(data, folder).items():
        with contextlib.suppress(OSError):  # reported when the scenario is read
            digests[name] = hashlib.sha256(path.read_bytes()).hexdigest()
    return digests


def _add(files: dict[str, Path], named_by: str, named: Iterator[tuple[str, Path]]) -> None:
    for text, path in named:
        name = f"{named_by}{text}"
        try:
            if name in files or not path.is_file() or path.stat().st_size > MAX_NAMED_FILE_BYTES:
                continue
            files[name] = path
            if named_by.count(" > ") < 2:  # scenario, robot, URDF, mesh
                _add(files, f"{name} > ", _named_in(path))
        except (OSError, ValueError):
            continue  # not a valid file name, or an unreadable file


def _named_in(path: Path) -> Iterator[tuple[str, Path]]:
    if path.suffix in _DOCUMENTS:
        for _, text in texts_in(read(path).data):
            yield text, path.parent / text
    elif path.suffix == ".urdf":
        for name in dict.fromkeys(_MESH.findall(read_text(path))):
            try:
                yield name, find_mesh(name, path)
            except InputError:
                continue
