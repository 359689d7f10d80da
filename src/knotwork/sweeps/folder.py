"""The folder of a study: its definition, and the rows that are finished, a file a chunk."""

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
KEPT = "what is finished is kept, go on with --resume"
PER_FOLDER = 1000
"""Files in a folder at most; folders of many thousands are slow to list."""


class StudyFolder:
    """The folder of one study.

    Attributes:
        path: Of the folder; `None` keeps the rows in memory.
        spec: The study.
        size: Rows in a chunk.
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
            InputError: It can't be written, or the study is gone.
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
        """Files of the chunks that are finished by their index, in order."""
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
    """Make the folder of a study.

    Raises:
        InputError: It can't be made, or there is a study, or rows of one whose description is gone.
    """
    folder = StudyFolder(path, spec, size)
    if folder.finished() and not is_study(path):
        raise InputError(
            f"{path} holds rows of a study, and no {STUDY} that says of which; give another folder"
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
            f"the study can't be written: {error}; accepted: values as a file may have them"
        ) from error
    try:
        storage.write_file(path / STUDY, text + "\n", replace=False)
    except InputError as error:
        if not is_study(path):
            raise
        raise InputError(
            f"{path} holds a study already; go on with it by --resume (resume=True), or give "
            "another folder"
        ) from error
    return folder


def open_study(path: Path) -> StudyFolder:
    """Open the folder of a study.

    Raises:
        InputError: It is none, or its `study.json` can't be understood.
    """
    data = _read(path)
    try:
        spec = spec_from_dict(data["study"], data["file"])
        size = int(data["chunk"])
        if size < 1:
            raise ValueError(f"its chunks have {size} rows")
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise InputError(
            f"{path / STUDY}: can't be understood ({type(error).__name__}: {error}); accepted: "
            "the file that knotwork sweep has written"
        ) from error
    return StudyFolder(path, spec, size)


def reopen(path: Path, spec: StudySpec, size: int | None) -> StudyFolder:
    """Open the folder of a study to go on with it.

    Args:
        path: Of the folder.
        spec: The study.
        size: Rows in a chunk; `None` for that of the folder.

    Raises:
        InputError: It holds another study, or one with chunks of another size.
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
            f"{path} holds another study: {first_difference(there, here)}; give the same scenario "
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
            "knotwork sweep has written"
        )
    try:
        data = json.loads(read_text(path / STUDY))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path / STUDY}: is no JSON: {error}") from error
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        raise InputError(f"{path / STUDY}: is not the description of a study")
    study = data.get("study")
    version = study.get("version") if isinstance(study, dict) else None
    if version != VERSION:
        raise InputError(
            f"{path / STUDY}: has version {version}, and {VERSION} is accepted; make the study anew"
        )
    return data
