"""Definition of a study: one scenario, and the axes that vary it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from knotwork.errors import InputError
from knotwork.files.documents import Document, Edits, Location, read, resources
from knotwork.files.documents.yaml_text import to_flow_yaml
from knotwork.planning.sweeps.field_path import location_of
from knotwork.planning.sweeps.figures import FIGURES
from knotwork.planning.sweeps.named_files import file_digests
from knotwork.planning.sweeps.outcome import Outcome
from knotwork.planning.sweeps.variations import Axis
from knotwork.task import Task
from knotwork.task.scenario import Scenario, load_scenario
from knotwork.verification.checks import changed_checks

TEXTS = ("verdict", "reason", "message")
"""Columns of a row on its outcome, besides the figures."""
MAX_WIDTH = 10**9
"""Width of YAML in a row, in characters, so large that it is never wrapped."""
STUDY_VERSION = 5
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
        seen: dict[Location, str] = {}
        for path, location in zip(self.paths, self.locations, strict=True):
            for earlier, name in seen.items():
                if location[: len(earlier)] == earlier or earlier[: len(location)] == location:
                    raise InputError(f"{path} and {name} vary the same value; leave out one")
            seen[location] = path

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
        values: list[Any] = []
        for axis in reversed(self.axes):
            row, i = divmod(row, len(axis))
            values = [column[i] for column in axis.columns] + values
        return tuple(values)

    def edits(self, row: int) -> Edits:
        """The values of a row by their location in the document."""
        return dict(zip(self.locations, self.values(row), strict=True))

    @cached_property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns, which are `row`, the varied fields, verdict and figures."""
        results = (*TEXTS, *FIGURES, "plan_time")
        varied = (f"given.{path}" if path in ("row", *results) else path for path in self.paths)
        return "row", *varied, *results

    def record(self, row: int, outcome: Outcome) -> dict[str, Any]:
        """Values of a finished row by column; varied mappings and lists are YAML."""
        values = (
            item if isinstance(item, int | float | str) else to_flow_yaml(item, width=MAX_WIDTH)
            for item in self.values(row)
        )
        figures = (outcome.figures.get(name) for name in FIGURES)
        finite = (x if x is not None and math.isfinite(x) else None for x in figures)
        texts = outcome.verdict, outcome.reason, outcome.message
        cells = (row, *values, *texts, *finite, outcome.plan_time)
        return dict(zip(self.columns, cells, strict=True))

    @cached_property
    def _files(self) -> dict[str, str]:
        """Digests of the files that the study depends on, by name."""
        folder = self.document.file.parent if self.document.file is not None else Path()
        columns = [column for axis in self.axes for column in axis.columns]
        return file_digests([self.document.data, *columns], folder)

    def to_dict(self) -> dict[str, Any]:
        """Return the definition as plain data, ready for JSON."""
        return {
            "version": STUDY_VERSION,
            "scenario": self.document.data,
            "files": self._files,
            "vary": [
                {path: list(column) for path, column in zip(axis.paths, axis.columns, strict=True)}
                for axis in self.axes
            ],
            "time_limit": self.time_limit,
            "checks": changed_checks(),
        }


def spec_from_dict(data: Mapping[str, Any], file: str | None) -> StudySpec:
    """Restore a definition from the data of `StudySpec.to_dict` and the path of its scenario."""
    axes = tuple(
        Axis(tuple(axis), tuple(tuple(column) for column in axis.values())) for axis in data["vary"]
    )
    document = Document(data["scenario"], file=Path(file) if file is not None else None)
    return StudySpec(document, axes, float(data["time_limit"]))


def scenario_document(scenario: str | Path | Mapping[str, Any] | Task | Scenario) -> Document:
    """Read the document of a scenario that is to be varied.

    Raises:
        InputError: The scenario is missing or wrong.
    """
    if isinstance(scenario, str | Path):
        path = resources.find("scenarios", scenario)
        load_scenario(path)  # which lists all its faults
        return read(path.absolute())
    if not isinstance(scenario, Scenario):
        scenario = load_scenario(scenario)
    return Document(scenario.task.to_dict(), file=scenario.source)
