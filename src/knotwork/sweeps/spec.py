"""Definition of a study: one scenario, and the axes that vary it."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from knotwork.documents import REMOVED, Document, Edits, Location, field_path, read, resources
from knotwork.documents.edits import differences
from knotwork.errors import InputError, shown
from knotwork.scenario import Scenario, load_scenario
from knotwork.sweeps.field_path import location_of
from knotwork.sweeps.figures import FIGURES
from knotwork.sweeps.named_files import file_digests
from knotwork.sweeps.variations import Axis
from knotwork.task import Task
from knotwork.verification.checks import own_checks

TEXTS = ("verdict", "reason", "message")
VERSION = 3
"""Version of the meaning of rows; folders of another version are not continued."""


@dataclass(frozen=True)
class StudySpec:
    """The definition of a study.

    Attributes:
        document: The varied scenario.
        axes: The varied fields; the rows are their product, the last axis fastest.
        time_limit: Time limit of a row [s].
    """

    document: Document
    axes: tuple[Axis, ...]
    time_limit: float

    def __post_init__(self) -> None:
        taken: dict[Location, str] = {}
        for path, location in zip(self.paths, self.locations, strict=True):
            for other, name in taken.items():
                if location[: len(other)] == other or other[: len(location)] == location:
                    raise InputError(f"{path} and {name} vary the same value; leave out one")
            taken[location] = path

    def __len__(self) -> int:
        return math.prod(len(axis) for axis in self.axes)

    @cached_property
    def paths(self) -> tuple[str, ...]:
        """The varied fields."""
        return tuple(path for axis in self.axes for path in axis.paths)

    @cached_property
    def locations(self) -> tuple[Location, ...]:
        """Locations of the varied fields in the document."""
        return tuple(location_of(path, self.document) for path in self.paths)

    def values(self, row: int) -> tuple[Any, ...]:
        """The values of a row, in the order of `paths`."""
        found: list[Any] = []
        for axis in reversed(self.axes):
            row, i = divmod(row, len(axis))
            found = [column[i] for column in axis.columns] + found
        return tuple(found)

    def edits(self, row: int) -> Edits:
        """The values of a row by their location in the document."""
        return dict(zip(self.locations, self.values(row), strict=True))

    @cached_property
    def columns(self) -> dict[str, str]:
        """The type of each column of the rows; number, varied fields, verdict and figures."""
        kinds = dict.fromkeys(TEXTS, "string") | dict.fromkeys((*FIGURES, "plan_time"), "double")
        varied = {}
        for axis in self.axes:
            for path, values in zip(axis.paths, axis.columns, strict=True):
                name = f"given.{path}" if path == "row" or path in kinds else path
                varied[name] = _kind(values)
        return {"row": "int64", **varied, **kinds}

    @cached_property
    def _files(self) -> dict[str, str]:
        """The files that the study depends on, each read once."""
        folder = self.document.file.parent if self.document.file is not None else Path()
        columns = [column for axis in self.axes for column in axis.columns]
        return file_digests([self.document.data, *columns], folder)

    def to_dict(self) -> dict[str, Any]:
        """Convert to plain data, ready for JSON."""
        return {
            "version": VERSION,
            "scenario": self.document.data,
            "files": self._files,
            "vary": [
                {path: list(column) for path, column in zip(axis.paths, axis.columns, strict=True)}
                for axis in self.axes
            ],
            "time_limit": self.time_limit,
            "checks": own_checks(),
        }

    @cached_property
    def digest(self) -> str:
        """SHA-256 of everything that determines the rows."""
        text = json.dumps(self.to_dict(), sort_keys=True, default=repr)
        return hashlib.sha256(text.encode()).hexdigest()


def spec_from_dict(data: Mapping[str, Any], file: str | None) -> StudySpec:
    """The study from the data of `StudySpec.to_dict`; `file` is the scenario's."""
    axes = tuple(
        Axis(tuple(axis), tuple(tuple(column) for column in axis.values())) for axis in data["vary"]
    )
    document = Document(data["scenario"], Path(file) if file is not None else None)
    return StudySpec(document, axes, float(data["time_limit"]))


def scenario_document(scenario: str | Path | Mapping[str, Any] | Task | Scenario) -> Document:
    """The document of a scenario to be varied.

    Raises:
        InputError: The scenario is missing or wrong.
    """
    if isinstance(scenario, str | Path):
        path = resources.find("scenarios", scenario)
        load_scenario(path)  # which lists all its faults
        return read(path.absolute())
    if not isinstance(scenario, Scenario):
        scenario = load_scenario(scenario)
    return Document(scenario.task.to_dict(), scenario.source)


def first_difference(one: Any, other: Any) -> str | None:
    """Describe the first difference between two studies."""
    for location, value in differences(one, other).items():
        old = one
        for key in location:
            if isinstance(old, Mapping) and key not in old:
                return f"{field_path(location)} is only here"
            old = old[key]
        if value is REMOVED:
            return f"{field_path(location)} is only there"
        return f"{field_path(location)} is {shown(old)} there and {shown(value)} here"
    return None


def _kind(values: Iterable[Any]) -> str:
    kinds = {type(value) for value in values}
    if kinds == {bool}:
        return "bool"
    if kinds == {int} and all(abs(value) < 2**62 for value in values):
        return "int64"
    return "double" if kinds <= {int, float} else "string"
