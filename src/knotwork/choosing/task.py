"""`FreeTask`: a scenario with something to choose, and its waypoints at the joints."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from knotwork.documents import Edits, edited
from knotwork.interpolation import BalancedKnots
from knotwork.joint_space import JointSpace
from knotwork.scenario import FreeTimes, Scenario, scenario_of
from knotwork.waypoints import JointWaypoints

if TYPE_CHECKING:
    from knotwork.timing import Dynamics


def knots_of(scenario: Scenario) -> Any:
    """Where the knots sit along tool paths."""
    knots = scenario.knots
    return BalancedKnots(float(knots)) if isinstance(knots, int | float) else knots


@dataclass(frozen=True, eq=False)
class FreeTask:
    """A scenario with something to choose, and its waypoints at the joints.

    Attributes:
        scenario: The task.
        free: What it leaves to be chosen.
        space: Its joints.
        waypoints: Its waypoints at the joints, at provisional times and speeds.
    """

    scenario: Scenario
    free: FreeTimes
    space: JointSpace
    waypoints: JointWaypoints

    @cached_property
    def dynamics(self) -> Dynamics | None:
        """Of its robot, if there is one; what is derived from it once serves all runs."""
        if self.space.robot is None:
            return None
        from knotwork.timing import Dynamics

        return Dynamics(self.space.robot)

    def with_edits(self, edits: Edits) -> Scenario:
        """The scenario with other values in its document."""
        return scenario_of(edited(self.free.document, edits))
