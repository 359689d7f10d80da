"""A study, complete or in part: its rows, and the best one."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import Any

from knotwork.errors import InputError
from knotwork.files import storage
from knotwork.planning import plan
from knotwork.planning.sweeps.field_path import scenario_with
from knotwork.planning.sweeps.figures import FIGURES, RowFigure, get_figure
from knotwork.planning.sweeps.folder import StudyFolder, open_study
from knotwork.planning.sweeps.outcome import ROW_PASSED
from knotwork.task.scenario import Scenario
from knotwork.task.si_units import unit_at
from knotwork.units import Units


class Study:
    """The finished rows of a study, in order.

    >>> lift = [{"joints": {"lift": 0}}, {"joints": {"lift": 1}, "after": 1}]
    >>> task = {"limits": {"velocity": 1.2}, "waypoints": lift}
    >>> study = kw.sweep(task, vary={"waypoints[1].after": [1, 2, 3]}, workers=0)
    >>> study["verdict"], study.best("duration")["waypoints[1].after"]
    (['failed', 'passed', 'passed'], 2)

    Attributes:
        spec: Definition of the study.
        folder: Folder with the rows, or `None` for rows in memory.
    """

    def __init__(self, study_folder: StudyFolder) -> None:
        self.spec, self.folder = study_folder.spec, study_folder.path
        self._rows = [row for _, row in sorted(study_folder.rows.items())]

    @classmethod
    def open(cls, folder: str | Path) -> Study:
        """Open the folder of a study.

        Raises:
            InputError: The folder is not a study, or a file of it can't be read.
        """
        return cls(open_study(Path(folder)))

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns, which are `row`, the varied fields, verdict and figures."""
        return self.spec.columns

    @property
    def varied(self) -> tuple[str, ...]:
        """Names of the columns of varied fields, in the order of `StudySpec.paths`."""
        return self.columns[1 : 1 + len(self.spec.paths)]

    @property
    def columns_by_axis(self) -> tuple[tuple[str, ...], ...]:
        """Names of the varied columns, those that vary together in one tuple."""
        names = iter(self.varied)
        return tuple(tuple(islice(names, len(axis.paths))) for axis in self.spec.axes)

    @property
    def name(self) -> str:
        """Name of the scenario."""
        document = self.spec.document
        name = document.data.get("name")
        return str(name or (document.file.stem if document.file is not None else "scenario"))

    @cached_property
    def titles(self) -> dict[str, str]:
        """Titles of the varied columns, with the unit in brackets where it is known."""
        data = self.spec.document.data
        units = (unit_at(data, location) for location in self.spec.locations)
        pairs = zip(self.varied, units, strict=True)
        return {name: f"{name} [{unit}]" if unit else name for name, unit in pairs}

    @cached_property
    def units(self) -> Units:
        """Units of the scenario's file; figures are in SI."""
        return Units(**self.spec.document.data.get("units", {}))

    @property
    def figures(self) -> dict[str, RowFigure]:
        """Descriptions of the figures, by the name of their column."""
        return FIGURES

    def __len__(self) -> int:
        return len(self._rows)

    def __getitem__(self, column: str) -> list[Any]:
        """Values of a column; missing ones are `None`.

        Raises:
            InputError: The column does not exist.
        """
        if column not in self.columns:
            raise InputError(f"no column {column!r}; accepted: {', '.join(self.columns)}")
        return [row[column] for row in self._rows]

    def rows(self) -> Iterator[dict[str, Any]]:
        """The rows, each by the names of the columns."""
        yield from map(dict, self._rows)

    @property
    def passed(self) -> int:
        """Number of rows that pass all checks."""
        return self["verdict"].count(ROW_PASSED)

    @property
    def reasons(self) -> dict[str, int]:
        """Number of rows that did not pass, by reason, most frequent first."""
        return dict(Counter(sorted(filter(None, self["reason"]))).most_common())

    def best(self, figure: str = "duration") -> dict[str, Any]:
        """The best row by a figure, among all rows that pass; the first one of ties.

        Raises:
            InputError: No row passes, or no row that passes has the figure.
        """
        row_figure = get_figure(figure)
        candidates = [
            row
            for row in self.rows()
            if row["verdict"] == ROW_PASSED and row[row_figure.name] is not None
        ]
        if not candidates:
            why = f"none of them has {figure}" if self.passed else "no row passes"
            raise InputError(f"there is no best row: {why}")
        sign = -1.0 if row_figure.more_is_better else 1.0
        return min(candidates, key=lambda row: sign * row[row_figure.name])

    def scenario(self, row: int) -> Scenario:
        """The scenario of a row.

        Raises:
            InputError: The study has no such row, or its scenario is wrong.
        """
        if not 0 <= row < len(self.spec):
            raise InputError(f"the study has no row {row}; accepted: 0 to {len(self.spec) - 1}")
        return scenario_with(self.spec.document, self.spec.edits(row))

    def freeze(self, row: int, path: str | Path) -> Path:
        """Write the scenario of a row, with the comments that its file still has.

        If times or speeds are unknown, the scenario is planned again and written with the chosen
        numbers, as by `Plan.freeze`.

        Args:
            row: Number of the row.
            path: The file to write; an existing one is replaced.

        Raises:
            InputError: The study has no such row, no motion with times to write was found,
                or the file can't be written.
        """
        from knotwork.planning.choosing import saved_text

        scenario, target = self.scenario(row), Path(path)
        values = plan(scenario).chosen_values if scenario.unknowns is not None else None
        with_numbers = scenario if values is None else values.scenario
        return storage.write_file(target, saved_text(with_numbers, target.parent))
