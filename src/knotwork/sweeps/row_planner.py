"""What plans the rows of a study: in this process, or in a child of it."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

from knotwork.documents import Document, Edits, edited
from knotwork.errors import KnotworkError
from knotwork.pipeline import Plan, plan
from knotwork.scenario import Scenario, scenario_of
from knotwork.sweeps.outcome import Outcome, judged, without_motion
from knotwork.sweeps.reach import ReachTest


class RowPlanner:
    """Plans rows, each given by a scenario's document and the values in place of its own.

    Robots and meshes are loaded once, since those that load them remember what they have loaded.
    """

    def __init__(self) -> None:
        self._read: dict[int, Scenario] = {}
        self._reach = ReachTest()

    def call(self, method: str, *arguments: Any, limit: float) -> Any:
        """Call a method as a `Child` does, in this process and without a time limit."""
        return getattr(self, method)(*arguments)

    def tested(self, document: Document, rows: Mapping[int, Edits]) -> dict[int, Outcome]:
        """Outcomes of those rows that need not be planned: they are wrong, or out of reach."""
        self._read, known = {}, dict[int, Outcome]()
        for row, edits in rows.items():
            try:
                self._read[row] = scenario_of(edited(document, edits))
            except Exception as error:
                known[row] = without_motion(error)
        return known | self._reach.refused(self._read)

    def outcome(self, row: int, document: Document, edits: Edits) -> Outcome:
        """Plan a row, which is not read again where it was tested last."""
        begin = time.perf_counter()
        try:
            made = plan(self._read.get(row) or scenario_of(edited(document, edits)))
            return judged(made, time.perf_counter() - begin)
        except Exception as error:  # a fault of Knotwork in one row is not the end of the others
            return without_motion(error, time.perf_counter() - begin)

    def plan(self, scenario: Any) -> Plan | KnotworkError:
        """Plan a scenario, or give the error that says why not."""
        try:
            return plan(scenario)
        except KnotworkError as error:
            return error
