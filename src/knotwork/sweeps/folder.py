"""The folder of a study: its definition, and the finished rows, one file per chunk."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

from knotwork import storage
from knotwork.documents import read_text
from knotwork.errors import InputError
from knotwork.sweeps.rows import own_version
from knotwork.sweeps.spec import VERSION, StudySpec, first_difference, spec_from_dict

STUDY, CHUNKS = "study.json", "chunks"
FORMAT = "knotwork.study"
KEPT = "finished rows are kept, continue with --resume"
PER_FOLDER = 1000
"""Largest number of files in a folder; folders of many thousands are slow to list."""


class StudyFolder:
    """The folder of a study.

    Attributes:
        path: Path of the folder; `None` keeps the rows in memory.
        spec: The study.
        size: Number of rows in a chunk.
    """

    def __init__(self, path: Path | None, spec: StudySpec, size: int) -> None:
        self.path, self.spec, self.size = path, spec, size
        self._kept: dict[int, bytes] = {}

    @property
    def count(self) -> int:
        """Number of chunks, finished or not."""
        return -(-len(self.spec) // self.size)

    def write(self, index: int, content: bytes) -> None:
        """Write the rows of a chunk, whole or not at all.

        Raises:
            InputError: The file can't be written, or the study was removed.
        """
        if self.path is None:
            self._kept[index] = content
            return
        if not is_study(self.path):
            raise InputError(f"{self.path}: {STUDY} was removed while the study was planned")
        try:
            storage.write_file(_file(self.path, index), content)
        except InputError as error:
            error.add(KEPT)
            raise

    def finished(self) -> dict[int, Any]:
        """Files of the finished chunks by index, in order."""
        if self.path is None:
            return {index: io.BytesIO(content) for index, content in sorted(self._kept.items())}
        found = {}
        for folder in sorted((self.path / CHUNKS).glob("*/")):
            for file in sorted(folder.glob("*.parquet")):
                if file.stem.isdecimal() and file == _file(self.path, int(file.stem)):
                    found[int(file.stem)] = file
        return found


def _file(folder: Path, index: int) -> Path:
    return folder / CHUNKS / f"{index // PER_FOLDER:04d}" / f"{index:07d}.parquet"


def is_study(path: Path | str) -> bool:
    """Whether a path is the folder of a study."""
    return (Path(path) / STUDY).is_file()


def create(path: Path, spec: StudySpec, size: int) -> StudyFolder:
    """Create the folder of a study.

    Raises:
        InputError: The folder can't be created, or has a study, or rows without description.
    """
    folder = StudyFolder(path, spec, size)
    if folder.finished() and not is_study(path):
        raise InputError(
            f"{path} has rows of a study but no {STUDY} that describes it; give another folder"
        )
    data = {
        "format": FORMAT,
        "knotwork": own_version(),
        "digest": spec.digest,
        "rows": len(spec),
        "chunk": size,
        "file": str(spec.document.file) if spec.document.file is not None else None,
        "study": spec.to_dict(),
    }
    try:
        text = json.dumps(data, indent=1, allow_nan=False)
    except TypeError as error:
        raise InputError(
            f"the study can't be written: {error}; accepted: values that a file can have"
        ) from error
    try:
        storage.write_file(path / STUDY, text + "\n", replace=False)
    except InputError as error:
        if not is_study(path):
            raise
        raise InputError(
            f"{path} has a study already; continue it with --resume (resume=True), or give "
            "another folder"
        ) from error
    return folder


def open_study(path: Path) -> StudyFolder:
    """Open the folder of a study.

    Raises:
        InputError: The folder is not a study, or its `study.json` is invalid.
    """
    data = _read(path)
    try:
        spec = spec_from_dict(data["study"], data["file"])
        size = int(data["chunk"])
        if size < 1:
            raise ValueError(f"its chunks have {size} rows")
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise InputError(
            f"{path / STUDY}: is invalid ({type(error).__name__}: {error}); accepted: "
            "the file written by knotwork sweep"
        ) from error
    return StudyFolder(path, spec, size)


def reopen(path: Path, spec: StudySpec, size: int | None) -> StudyFolder:
    """Open the folder of a study to continue it.

    Args:
        path: Path of the folder.
        spec: The study.
        size: Number of rows in a chunk; `None` for that of the folder.

    Raises:
        InputError: The folder has another study, or one with chunks of another size.
    """
    data = _read(path)
    if data.get("knotwork") != own_version():
        raise InputError(
            f"{path} was begun by version {data.get('knotwork')} of knotwork, and this is "
            f"{own_version()}, whose rows may differ; give another folder"
        )
    there, here = data.get("study"), json.loads(json.dumps(spec.to_dict()))
    if there != here:
        raise InputError(
            f"{path} has another study: {first_difference(there, here)}; give the same scenario "
            "and values, or another folder"
        )
    folder = StudyFolder(path, spec, open_study(path).size)
    if size not in (None, folder.size):
        raise InputError(
            f"chunk is {size}, and {path} has chunks of {folder.size} rows; leave chunk out"
        )
    return folder


def _read(path: Path) -> dict[str, Any]:
    if not is_study(path):
        raise InputError(
            f"{path} is not the folder of a study: it has no {STUDY}; accepted: a folder that "
            "written by knotwork sweep"
        )
    try:
        data = json.loads(read_text(path / STUDY))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path / STUDY}: is not JSON: {error}") from error
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        raise InputError(f"{path / STUDY}: is not the description of a study")
    study = data.get("study")
    version = study.get("version") if isinstance(study, dict) else None
    if version != VERSION:
        raise InputError(
            f"{path / STUDY}: has version {version}, and {VERSION} is accepted; run the study again"
        )
    return data
