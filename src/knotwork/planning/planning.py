"""`plan`: from a scenario to a checked trajectory."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from knotwork.curves.interpolation import PLANNER_SPECS, planner_and_rule
from knotwork.errors import InputError
from knotwork.planning.avoidance import best_of_sequences
from knotwork.planning.planned_motion import Plan
from knotwork.planning.planner_options import Knots
from knotwork.planning.scenario_planner import ScenarioPlanner
from knotwork.task import Task
from knotwork.task.scenario import Scenario, load_scenario, resolve_task

if TYPE_CHECKING:
    from knotwork.planning.timing import Progress


def plan(
    scenario: str | Path | Mapping[str, Any] | Task | Scenario,
    *,
    planner: str | None = None,
    knots: Knots = None,
    budget: float | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Plan:
    """Plan a scenario and check the result.

    Free times and speeds are chosen first; `Plan.scenario` has numbers in their place.

    >>> lift = [{"joints": {"lift": 0}}, {"joints": {"lift": 1}, "after": 2}]
    >>> plan = kw.plan({"waypoints": lift})
    >>> plan.report.ok, plan.trajectory.position(1.0)
    (True, array([0.5]))

    Args:
        scenario: A task, the name of a shipped scenario, the path of a file, a mapping with the
            same keys, or a loaded scenario.
        planner: Planner in place of the scenario's; a rule may follow after a colon, as in
            `"quintic:estimated"`. Options that it does not support are left out, and
            `Plan.left_out` names them.
        knots: Knots in place of the scenario's: `"paper"`, `"balanced"`, `BalancedKnots` or their
            constant, the knot times [s], or `"optimal"` for chosen knots.
        budget: Computing time for free times [s], by default unlimited. Segments that are not
            solved within it rest at each waypoint.
        progress: Callback of the solver for free times.

    Returns:
        The plan. `report.ok` is true if the motion meets all requirements. An exceeded limit raises
        no error.

    Raises:
        InputError: The scenario is wrong, or a waypoint is infeasible. The error names the field,
            its location, the value and the accepted values.
    """
    if not isinstance(scenario, Scenario):
        scenario = load_scenario(scenario)
    if isinstance(knots, str) and knots == "optimal":
        scenario, knots = _with_optimal_knots(scenario, planner or scenario.si.planner), None
    if scenario.free is None:
        return best_of_sequences(ScenarioPlanner(scenario, planner, knots))
    from knotwork.planning.choosing import with_times_met
    from knotwork.planning.timing.budget import Budget

    free = scenario.free
    met = tuple(scenario.waypoints[i].name for i in free.meets if free.duration[i - 1])
    timed = ScenarioPlanner(scenario, planner, knots, Budget(seconds=budget), progress, met)
    if free.meets:
        scenario = with_times_met(
            scenario, lambda expected: replace(timed, scenario=expected).choose_times()
        )
    return best_of_sequences(replace(timed, scenario=scenario))


def _with_optimal_knots(scenario: Scenario, planner: str) -> Scenario:
    """The scenario with knots to be chosen.

    Raises:
        InputError: The planner does not support chosen knots, or has its own knots.
    """
    base, ruled = planner_and_rule(planner)
    if "chosen" not in PLANNER_SPECS[base].supports or "knots" in ruled:
        raise InputError(
            f"{scenario.name}: knots: optimal are those of modified-hermite, which "
            f"{planner!r} does not take; give one of the two"
        )
    return resolve_task(scenario.task.replace(knots="optimal"), scenario.places)
