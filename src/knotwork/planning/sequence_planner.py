"""`SequencePlanner`: a scenario with one sequence of IK solutions, planned and checked."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import replace
from typing import TYPE_CHECKING

from knotwork.curves.interpolation import (
    PLANNER_SPECS,
    PlannerOptions,
    get_planner,
    planner_and_rule,
)
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import InputError, KnotError, OptionError
from knotwork.errors.plain_text import waypoint_text
from knotwork.planning.planned_motion import Plan
from knotwork.planning.planner_options import planner_options, supported_options
from knotwork.planning.task_to_joint import SequenceStep, TaskSolution, solve_task
from knotwork.planning.timing.budget import Budget
from knotwork.task.scenario import Scenario
from knotwork.task.scenario.motion_segments import motion_segments, stored_clear_motions
from knotwork.task.scenario.scenario_joints import read_scenario_joints
from knotwork.verification import check
from knotwork.waypoints import JointWaypoints

if TYPE_CHECKING:
    from knotwork.planning.choosing import ChosenValues


class SequencePlanner:
    """Plans one sequence of IK solutions at a time: chooses unknowns, interpolates, checks.

    Args:
        scenario: The scenario.
        requested_planner: The planner to take instead of its own, or `None`.
        budget: Budget and progress of all plans together.
        original_scenario: The scenario before any value was chosen.

    Attributes:
        scenario: The scenario, with the planner that is taken.
        requested_planner, budget, original_scenario: As given.
        joints: Its joints.
        options: Options of the planner, in SI.
        unsupported: Names of the scenario's options that the planner does not support.

    Raises:
        InputError: An option is wrong, or the planner does not support it.
    """

    def __init__(
        self,
        scenario: Scenario,
        requested_planner: str | None,
        budget: Budget,
        original_scenario: Scenario,
    ) -> None:
        self.requested_planner = requested_planner
        self.budget = budget
        self.original_scenario = original_scenario
        original = scenario.planner
        with nullcontext() if requested_planner else scenario.locations.errors_at("planner"):
            get_planner(requested_planner or original)
        self.scenario = replace(scenario, planner=requested_planner or original)
        self.joints = read_scenario_joints(self.scenario)
        self.options = planner_options(scenario, self.joints)
        self.unsupported: tuple[str, ...] = ()
        if requested_planner and requested_planner != original:
            self.options, unsupported = supported_options(self.options, original, requested_planner)
            if not original_scenario.task.chosen:  # `fix_arrival_times` wrote it, not the user
                unsupported = tuple(name for name in unsupported if name != "chosen")
            self.unsupported = unsupported

    def with_scenario(self, scenario: Scenario) -> SequencePlanner:
        """The same for another scenario."""
        return SequencePlanner(
            scenario, self.requested_planner, self.budget, self.original_scenario
        )

    def solve(
        self, blocked_steps: Sequence[SequenceStep] = (), earlier: TaskSolution | None = None
    ) -> TaskSolution:
        """Find the best sequence of solutions that takes no blocked step."""
        base, set_by_rule = planner_and_rule(self.scenario.planner)
        knots = PlannerOptions().knots
        if "knots" in PLANNER_SPECS[base].supports:
            knots = set_by_rule.get("knots", self.options.knots)
        return solve_task(self.scenario, self.joints, knots, blocked_steps, earlier)

    def plan(self, solution: TaskSolution) -> Plan:
        """Choose the unknowns for a sequence of solutions, plan its motion, and check it."""
        if self.original_scenario.unknowns is None:
            return self._interpolate(solution)
        from knotwork.planning.choosing import ChosenValues, SolvedScenario, choose_values

        if self.scenario.unknowns is None:  # `fix_arrival_times` has chosen every unknown
            chosen_values = ChosenValues(self.original_scenario, self.scenario, solution)
            return self._interpolate(solution, chosen_values)
        solved = SolvedScenario(self.scenario, self.joints, solution, self.original_scenario)
        chosen_values = choose_values(solved, self.budget)
        self.budget.finish_all(chosen_values.duration)
        timed = self.with_scenario(chosen_values.scenario)
        return timed._interpolate(timed._solve_again(chosen_values.solution), chosen_values)

    def _solve_again(self, before: TaskSolution) -> TaskSolution:
        """The solution found before any value was chosen, with waypoints at the chosen values.

        The keys `near` of the scenario lead to the same IK solutions. Its alternatives are still
        those of the scenario with unknowns.
        """
        timed = self.solve(earlier=before)
        return replace(before, waypoints=timed.waypoints, infeasibilities=timed.infeasibilities)

    def _interpolate(
        self, solution: TaskSolution, chosen_values: ChosenValues | None = None
    ) -> Plan:
        """Interpolate a sequence of solutions, and check the motion."""
        scenario, joints, waypoints = self.scenario, self.joints, solution.waypoints
        trajectory = self._trajectory(waypoints)
        clear_motions = [*stored_clear_motions(scenario)] if self.options.chosen else []
        starts = {i for motion in clear_motions for i in motion.indices[:-1]}
        trajectory = replace(
            trajectory,
            events=tuple(event.event for event in scenario.events),
            loads=joints.loaded_robots.loads(trajectory.start_time) if joints.loaded_robots else (),
            segments=motion_segments(scenario, starts),
        )
        findings = [*solution.infeasibilities]
        if chosen_values is not None:
            from knotwork.planning.choosing.chosen_values_findings import chosen_values_findings

            findings += chosen_values_findings(chosen_values, joints)
        if clear_motions:
            from knotwork.planning.choosing.chosen_values_findings import clear_motion_findings

            findings += clear_motion_findings(clear_motions, scenario, joints, trajectory)
        report = check(trajectory, scenario, joints=joints, known=findings)
        return Plan(
            scenario,
            joints,
            waypoints,
            trajectory,
            report,
            unsupported_options=self.unsupported,
            solution=solution,
            chosen_values=chosen_values,
        )

    def _trajectory(self, waypoints: JointWaypoints) -> JointTrajectory:
        """Interpolate joint waypoints.

        Raises:
            InputError: The planner can't interpolate them. The error names a field of the scenario,
                or the argument that was given instead.
        """
        try:
            return get_planner(self.scenario.planner)(waypoints, self.options)
        except InputError as error:
            field: tuple[str, ...] = ("planner",)
            if isinstance(error, KnotError):
                field = ("knots",)
                if (i := error.waypoint_index) is not None:
                    first, *following = map(waypoint_text, waypoints.names[i : i + 2])
                    if error.interval is None:
                        error.locate(f"at {first}")
                    else:
                        error.locate(f"between {first} and {following[0]}")
            elif isinstance(error, OptionError):
                option = error.option
                field = ("planner_options", option) if option == "accelerations" else (option,)
            if self.requested_planner and field == ("planner",):
                error.locate(f"{self.scenario.name}: planner")
                raise
            with self.scenario.locations.errors_at(*field):
                raise
