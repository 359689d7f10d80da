"""`plan`: from a scenario to a checked trajectory."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from knotwork.planning.best_sequence import best_of_sequences
from knotwork.planning.planned_motion import Plan
from knotwork.planning.sequence_planner import SequencePlanner
from knotwork.planning.timing.budget import Budget, Progress
from knotwork.task import Task
from knotwork.task.scenario import Scenario, load_scenario


def plan(
    scenario: str | Path | Mapping[str, Any] | Task | Scenario,
    *,
    planner: str | None = None,
    budget: float | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Plan:
    """Plan a scenario and check the result.

    Unknown times and speeds are chosen first; `Plan.scenario` has numbers in their place.

    >>> lift = [{"joints": {"lift": 0}}, {"joints": {"lift": 1}, "after": 2}]
    >>> plan = kw.plan({"waypoints": lift})
    >>> plan.report.ok, plan.trajectory.position(1.0)
    (True, array([0.5]))

    Args:
        scenario: A task, the name of a shipped scenario, the path of a file, a mapping with the
            same keys, or a loaded scenario.
        planner: Planner in place of the scenario's; a rule may follow after a colon, as in
            `"quintic:estimated"`. Options that it does not support are left out, and
            `Plan.unsupported_options` names them.
        budget: Computing time [s], by default unlimited. Sections that are not solved within it
            rest at each waypoint, and no further sequences of solutions are tried.
        progress: Callback of the solver for unknown times.

    Returns:
        The plan. `report.ok` is true if the motion meets all requirements. An exceeded limit raises
        no error.

    Raises:
        InputError: The scenario is wrong, or a waypoint is infeasible. The error names the field,
            its location, the value and the accepted values.
    """
    if not isinstance(scenario, Scenario):
        scenario = load_scenario(scenario)
    original_scenario, unknowns = scenario, scenario.unknowns
    work = Budget(progress, budget)
    if unknowns is not None and unknowns.time_dependent:
        from knotwork.planning.choosing import fix_arrival_times

        scenario = fix_arrival_times(scenario, work)
    return best_of_sequences(SequencePlanner(scenario, planner, work, original_scenario))
