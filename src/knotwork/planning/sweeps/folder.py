"""Folders of studies, each with its definition and a line of JSON for each finished row."""

from __future__ import annotations

import json
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from knotwork.errors import InputError
from knotwork.files import storage
from knotwork.files.documents import field_path, read_text
from knotwork.files.documents.edits import differences
from knotwork.planning.sweeps.outcome import Outcome
from knotwork.planning.sweeps.spec import STUDY_VERSION, StudySpec, spec_from_dict

STUDY, ROWS = "study.json", "rows.jsonl"
"""Names of the files in the folder of a study: its definition, and its finished rows."""
STUDY_FORMAT = "knotwork.study"
MAX_STUDY_BYTES = 2_000_000_000
"""Maximum size of a file of rows that is read [bytes], enough for a million rows."""
RESUME_ADVICE = "finished rows are kept; resume the study"


def own_version() -> str:
    """Version of Knotwork; empty if it is not installed but only on the path."""
    try:
        return version("knotwork")
    except PackageNotFoundError:
        return ""


class StudyFolder:
    """The finished rows of a study, in memory and in a folder.

    Attributes:
        path: Path of the folder; `None` keeps the rows in memory only.
        spec: The study.
        rows: The finished rows by number, each a mapping of columns to values.
    """

    def __init__(self, path: Path | None, spec: StudySpec) -> None:
        self.path, self.spec = path, spec
        self.rows: dict[int, dict[str, Any]] = {}

    def add(self, row: int, outcome: Outcome) -> None:
        """Keep the outcome of a row, in memory and at once in the folder.

        Raises:
            InputError: The file can't be written, or the study was removed.
        """
        self.rows[row] = self.spec.record(row, outcome)
        if self.path is None:
            return
        if not is_study(self.path):
            raise InputError(f"{self.path}: {STUDY} was removed while the study was planned")
        try:
            with (self.path / ROWS).open("a", encoding="utf-8") as file:
                file.write(json.dumps(self.rows[row]) + "\n")
        except OSError as error:
            reason = error.strerror or error
            raise InputError(f"can't write to {self.path}: {reason}; {RESUME_ADVICE}") from error

    def read(self) -> None:
        """Read the finished rows, without a last line that the end of a process cut off.

        Raises:
            InputError: The file can't be read, or has other lines than rows of the study.
        """
        file = (self.path or Path()) / ROWS
        if not file.exists():
            return
        complete, _, _ = read_text(file, MAX_STUDY_BYTES).rpartition("\n")
        for number, line in enumerate(complete.splitlines(), start=1):
            try:
                record = json.loads(line)
                row = record["row"]
                if tuple(record) != self.spec.columns or row not in range(len(self.spec)):
                    raise ValueError("it is not a row of this study")
            except (ValueError, LookupError, TypeError, RecursionError) as error:
                raise InputError(
                    f"{file}: line {number} can't be read ({error}); remove it, then resume"
                ) from error
            self.rows[row] = record


def is_study(path: Path | str) -> bool:
    """Whether a path is the folder of a study."""
    return (Path(path) / STUDY).is_file()


def create(path: Path, spec: StudySpec) -> StudyFolder:
    """Create the folder of a study.

    Raises:
        InputError: The folder can't be created, or has a study, or rows without a definition.
    """
    if (path / ROWS).exists() and not is_study(path):
        raise InputError(
            f"{path} has rows of a study but no {STUDY} that describes it; give another folder"
        )
    data = {
        "format": STUDY_FORMAT,
        "knotwork": own_version(),
        "rows": len(spec),
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
            f"{path} has a study already; resume it, or give another folder"
        ) from error
    return StudyFolder(path, spec)


def open_study(path: Path) -> StudyFolder:
    """Open the folder of a study.

    Raises:
        InputError: The folder is not a study, or its files are invalid.
    """
    data = _read(path)
    try:
        folder = StudyFolder(path, spec_from_dict(data["study"], data["file"]))
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise InputError(
            f"{path / STUDY}: is invalid ({type(error).__name__}: {error}); accepted: "
            "the file written by knotwork sweep"
        ) from error
    folder.read()
    return folder


def reopen(path: Path, spec: StudySpec) -> StudyFolder:
    """Open the folder of a study to continue it.

    Raises:
        InputError: The folder has another study, or one of another version.
    """
    data = _read(path)
    if data.get("knotwork") != own_version():
        raise InputError(
            f"{path} was begun by version {data.get('knotwork')} of knotwork, and this is "
            f"{own_version()}, whose rows may differ; give another folder"
        )
    old, new = data.get("study"), json.loads(json.dumps(spec.to_dict()))
    if changes := differences(old, new):
        raise InputError(
            f"{path} has another study: {field_path(next(iter(changes)))} differs; give the same "
            "scenario and values, or another folder"
        )
    folder = open_study(path)
    lines = "".join(json.dumps(record) + "\n" for record in folder.rows.values())
    storage.write_file(path / ROWS, lines)  # without a line that was cut off
    return folder


def _read(path: Path) -> dict[str, Any]:
    if not is_study(path):
        raise InputError(
            f"{path} is not the folder of a study: it has no {STUDY}; accepted: a folder "
            "written by knotwork sweep"
        )
    try:
        data = json.loads(read_text(path / STUDY))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path / STUDY}: is not JSON: {error}") from error
    if not isinstance(data, dict) or data.get("format") != STUDY_FORMAT:
        raise InputError(f"{path / STUDY}: is not the description of a study")
    study = data.get("study")
    number = study.get("version") if isinstance(study, dict) else None
    if number != STUDY_VERSION:
        raise InputError(
            f"{path / STUDY}: has version {number}, and {STUDY_VERSION} is accepted; run the study "
            "again"
        )
    return data
