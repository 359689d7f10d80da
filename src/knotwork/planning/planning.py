"""The whole way from a scenario to a checked trajectory."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from knotwork.errors import InputError
from knotwork.planning.avoidance import best_of_sequences
from knotwork.planning.execution import ExecutedMotion
from knotwork.planning.planner_options import Knots
from knotwork.planning.replanning import scenario_from
from knotwork.planning.scenario_planner import ScenarioPlanner
from knotwork.scenario import Scenario, load_scenario
from knotwork.spline.interpolation import PLANNER_SPECS, planner_and_rule
from knotwork.task import Task

if TYPE_CHECKING:
    from knotwork.planning.timing import Progress
    from knotwork.view.page import Page


class Plan(ExecutedMotion):
    """A planned motion with its verdict, which can be shown, saved and changed.

    >>> swing = kw.plan("paper_case")
    >>> swing.joint_waypoints.time, swing.trajectory.end_time, swing.report.ok
    (array([ 0.,  5., 15., 25.]), 25.0, True)
    """

    def view(self, compare: Sequence[str] = ()) -> Page:
        """Show the arm making its move, in 3D.

        A notebook shows the page inline; `save` writes it to a file that any browser opens.

        Args:
            compare: Planners whose motions are shown over it, as translucent arms.

        Raises:
            InputError: The scenario has no robot, or another planner can't plan it.
        """
        from knotwork.view.plan_pages import view_plan

        others = {name: plan(self.scenario, planner=name).trajectory for name in compare}
        return view_plan(self, others)

    def play(self, viewer: Any) -> None:
        """Show the arm making its move in a Meshcat viewer that is running.

        Robot, path, waypoints, frames and scene are drawn below `knotwork`, in the axes of the
        URDF's root, and the motion starts. All else in the viewer stays, but a robot that
        Pinocchio's visualizer shows is hidden; `displayVisuals(True)` shows it again.

        Args:
            viewer: A `meshcat.Visualizer`, or Pinocchio's `MeshcatVisualizer`.

        Raises:
            InputError: The viewer is neither, or the scenario has no robot.
        """
        from knotwork.view.meshcat_player import play_scene
        from knotwork.view.scene_data import scene_of

        play_scene(scene_of(self), viewer)

    def replace(self, at: float, scenario: str | Path | Mapping[str, Any] | Task) -> Plan:
        """Plan another task from this motion's state at a moment, which is its time 0.

        Position, velocity and acceleration go on without a jump. The state takes the place of the
        task's `start`, or else of its first waypoint, if it has more than one. Times in the task,
        of frames that move and of other robots too, are since that moment.

        Args:
            at: The moment [s].
            scenario: The new task.

        Raises:
            InputError: The time is outside the motion, the tool holds something of which the task
                says nothing, or the task is wrong: as `plan`.
        """
        return plan(scenario_from(self.trajectory, at, scenario, self.scenario))


def plan(
    scenario: str | Path | Mapping[str, Any] | Task | Scenario,
    *,
    planner: str | None = None,
    knots: Knots = None,
    budget: float | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Plan:
    """Plan a scenario and check the result.

    Times and speeds that it leaves free are chosen first; `Plan.scenario` has numbers in their
    place.

    >>> lift = [{"joints": {"lift": 0}}, {"joints": {"lift": 1}, "after": 2}]
    >>> plan = kw.plan({"waypoints": lift})
    >>> plan.report.ok, plan.trajectory.position(1.0)
    (True, array([0.5]))

    Args:
        scenario: A task, a shipped scenario's name, the path of a file, a mapping of the same
            shape, or a loaded scenario.
        planner: Takes the place of the scenario's planner; a rule may follow after a colon, as in
            `"quintic:estimated"`. Options that it does not support are left out, and
            `Plan.left_out` names them.
        knots: Takes the place of the scenario's knots: `"paper"`, `"balanced"`, `BalancedKnots` or
            their constant, or the knot times [s]; `"optimal"` to have them chosen.
        budget: Computing time for free times [s], by default unlimited; segments that are not
            solved by then rest at each waypoint.
        progress: Callback of the solver for free times.

    Returns:
        The plan. Its `report.ok` tells whether the motion meets all requirements: an exceeded limit
        raises no error.

    Raises:
        InputError: The scenario is wrong, or a waypoint can't be met as asked. The error names
            what, where, the value found and the accepted values.
    """
    if not isinstance(scenario, Scenario):
        scenario = load_scenario(scenario)
    if isinstance(knots, str) and knots == "optimal":
        scenario, knots = _with_optimal_knots(scenario, planner or scenario.si.planner), None
    if scenario.free is None:
        return _best_plan(ScenarioPlanner(scenario, planner, knots))
    from knotwork.planning.choosing import with_times_met
    from knotwork.planning.timing.budget import Budget

    free = scenario.free
    met = tuple(scenario.waypoints[i].name for i in free.meets if free.duration[i - 1])
    timed = ScenarioPlanner(scenario, planner, knots, Budget(seconds=budget), progress, met)
    if free.meets:
        scenario = with_times_met(
            scenario, lambda expected: replace(timed, scenario=expected).choose_times()
        )
    return _best_plan(replace(timed, scenario=scenario))


def _with_optimal_knots(scenario: Scenario, planner: str) -> Scenario:
    """The scenario with knots to be chosen.

    Raises:
        InputError: The planner takes no chosen knots, or has knots of its own.
    """
    from knotwork.planning.choosing import with_optimal_knots

    base, ruled = planner_and_rule(planner)
    if "chosen" not in PLANNER_SPECS[base].supports or "knots" in ruled:
        raise InputError(
            f"{scenario.name}: knots: optimal are those of modified-hermite, which "
            f"{planner!r} does not take; give one of the two"
        )
    return with_optimal_knots(scenario)


def _best_plan(planner: ScenarioPlanner) -> Plan:
    return Plan(**vars(best_of_sequences(planner)))
