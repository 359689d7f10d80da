"""Where rows are planned, one block of a study at a time: in this process, or in a child of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from knotwork.documents import Document, Edits, Location, edited
from knotwork.errors import InputError, KnotworkError
from knotwork.scenario import Scenario, scenario_of

if TYPE_CHECKING:
    from knotwork.pipeline import Plan
    from knotwork.sweeps.outcome import Outcome
    from knotwork.sweeps.placing import Placing
    from knotwork.sweeps.reach import ReachTest


@dataclass(frozen=True)
class Block:
    """Some rows of a study, with all that is needed to plan them.

    Attributes:
        document: The scenario that is varied.
        locations: The places that are varied in it.
        values: For each row of the block the values, by row.
    """

    document: Document
    locations: tuple[Location, ...]
    values: Mapping[int, tuple[Any, ...]]

    def edits(self, row: int) -> Edits:
        """The values of a row that replace those of the document."""
        return dict(zip(self.locations, self.values[row], strict=True))


class RowPlanner:
    """Plans rows of the block it was given last.

    Robots and meshes are loaded once, since those that load them remember what they have loaded.
    """

    def __init__(self) -> None:
        self._block = Block(Document(None), (), {})
        self._scenarios: dict[int, Scenario] = {}
        self._placing: Placing | None = None
        self._reach: ReachTest | None = None

    def begin(self, block: Block, tested: bool) -> dict[int, Outcome]:
        """Take a block, and find the rows that need not be planned.

        Args:
            block: The rows.
            tested: Whether their poses are tested for being reachable.

        Returns:
            Outcomes of rows that are wrong, or out of reach.
        """
        self._block, self._scenarios = block, {}
        return self._tested(block) if tested else {}

    def outcome(self, row: int) -> Outcome:
        """Plan a row."""
        from knotwork.sweeps.outcome import crashed, outcome_of, refused

        try:
            scenario = self._scenario(row)
        except InputError as error:
            return refused(error)
        except Exception as error:
            return crashed(error)
        return outcome_of(scenario, self._block.locations)

    def _scenario(self, row: int) -> Scenario:
        """The scenario of a row, read once."""
        if row not in self._scenarios:
            document = edited(self._block.document, self._block.edits(row))
            self._scenarios[row] = scenario_of(document)
        return self._scenarios[row]

    def _tested(self, block: Block) -> dict[int, Outcome]:
        from knotwork.sweeps.outcome import refused
        from knotwork.sweeps.placing import poses_of
        from knotwork.sweeps.reach import PosesOfRow, ReachTest

        self._reach = self._reach or ReachTest()
        self._place(block.document)
        asked: dict[int, PosesOfRow] = {}
        known: dict[int, Outcome] = {}
        for row in block.values:
            placing = self._placing
            moved = placing.poses(block.edits(row)) if placing is not None else None
            if placing is not None and moved is not None:
                asked[row] = PosesOfRow(placing.scenario, moved)
                continue
            try:
                scenario = self._scenario(row)
            except InputError as error:
                known[row] = refused(error)
            except Exception:
                continue  # `outcome` says so
            else:
                asked[row] = PosesOfRow(scenario, poses_of(scenario))
        return known | self._reach.refused(asked)

    def _place(self, document: Document) -> None:
        """Be ready for rows of a document in which frames are placed otherwise."""
        from knotwork.sweeps.placing import Placing

        if self._placing is not None and self._placing.document == document:
            return
        try:
            self._placing = Placing(document)
        except InputError:  # rows may be right where it is wrong
            self._placing = None

    def plan(self, scenario: Any) -> Plan | KnotworkError:
        """Plan a scenario, or give the error that says why not."""
        from knotwork.pipeline import plan

        try:
            return plan(scenario)
        except KnotworkError as error:
            return error
