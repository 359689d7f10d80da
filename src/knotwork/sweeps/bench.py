"""Where rows are planned, one block of a study at a time: in this process, or in a child of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from knotwork.documents import Document, Location, edited
from knotwork.errors import InputError, KnotworkError
from knotwork.scenario import Scenario, scenario_of

if TYPE_CHECKING:
    from knotwork.pipeline import Plan
    from knotwork.sweeps.outcome import Outcome


@dataclass(frozen=True)
class Block:
    """Some rows of a study, with all that is needed to plan them.

    Attributes:
        document: The scenario that is varied.
        locations: What is varied in it.
        values: For each row of the block the values, by row.
    """

    document: Document
    locations: tuple[Location, ...]
    values: Mapping[int, tuple[Any, ...]]


class Bench:
    """Plans rows of the block it was given last.

    Robots and meshes are loaded once, since those that load them remember what they have loaded.
    """

    def __init__(self) -> None:
        self._scenarios: dict[int, Scenario] = {}

    def begin(self, block: Block, tested: bool) -> dict[int, Outcome]:
        """Take a block, and find the rows that need not be planned.

        Args:
            block: The rows.
            tested: Whether their poses are tested for being reachable.

        Returns:
            Outcomes of rows that are wrong, or out of reach.
        """
        from knotwork.sweeps.outcome import refused

        self._scenarios, known = {}, {}
        for row, values in block.values.items():
            try:
                edits = dict(zip(block.locations, values, strict=True))
                self._scenarios[row] = scenario_of(edited(block.document, edits))
            except InputError as error:
                known[row] = refused(error)
        if tested:
            from knotwork.sweeps.reach import out_of_reach

            known |= out_of_reach(self._scenarios)
        return known

    def outcome(self, row: int) -> Outcome:
        """Plan a row."""
        from knotwork.sweeps.outcome import outcome_of

        return outcome_of(self._scenarios[row])

    def plan(self, scenario: Any) -> Plan | KnotworkError:
        """Plan a scenario, or give the error that says why not."""
        from knotwork.pipeline import plan

        try:
            return plan(scenario)
        except KnotworkError as error:
            return error
