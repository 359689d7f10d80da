"""`SequencePlanner`: a scenario with one sequence of IK solutions, planned and checked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

from knotwork.planning.planned_motion import Plan
from knotwork.planning.planner_options import Interpolator
from knotwork.planning.task_to_joint import SequenceStep, TaskSolution, solve_task
from knotwork.planning.timing.timed_motion import Budget
from knotwork.task.scenario import Scenario
from knotwork.task.scenario.motion_segments import find_clear_motions, motion_segments
from knotwork.verification import check

if TYPE_CHECKING:
    from knotwork.planning.choosing import ChosenValues


@dataclass(frozen=True, eq=False)
class SequencePlanner:
    """Plans one sequence of IK solutions at a time: chooses free values, interpolates, checks.

    Attributes:
        scenario: The scenario; its free values are chosen before it is planned.
        planner: Planner that replaces the scenario's own, or `None`.
        budget: Budget and progress of all plans together.
        fixed_arrivals: Waypoints in moving frames, by name, whose times were chosen first.
    """

    scenario: Scenario
    planner: str | None
    budget: Budget = field(default_factory=Budget)
    fixed_arrivals: tuple[str, ...] = ()

    @cached_property
    def _interpolator(self) -> Interpolator:
        return Interpolator.for_scenario(self.scenario, self.planner)

    def solve(self, avoided: Sequence[SequenceStep] = ()) -> TaskSolution:
        """Find the best sequence of solutions that takes none of the steps to avoid."""
        interpolator = self._interpolator
        scenario, joints = interpolator.scenario, interpolator.joints
        return solve_task(scenario, joints, interpolator.knots_along_paths, avoided)

    def plan(self, solution: TaskSolution | None = None) -> Plan:
        """Plan a sequence of solutions, by default the best, and check the motion."""
        if self.scenario.free_values is None:
            return self._interpolate(solution or self.solve())
        from knotwork.planning.choosing import choose_times

        chosen = choose_times(self.scenario, self.budget, solution)
        chosen = replace(chosen, fixed_arrivals=self.fixed_arrivals)
        self.budget.finish(self.budget.work)
        self.budget.step(0, chosen.duration, "check")
        fixed = replace(self, scenario=chosen.scenario)
        return fixed._interpolate(fixed.solve(), chosen)

    def _interpolate(self, solution: TaskSolution, chosen: ChosenValues | None = None) -> Plan:
        """Interpolate a sequence of solutions, and check the motion."""
        interpolator, waypoints = self._interpolator, solution.waypoints
        scenario, joints = interpolator.scenario, interpolator.joints
        trajectory = interpolator.trajectory(waypoints)
        clear_motions = [*find_clear_motions(scenario)] if interpolator.options.chosen else []
        starts = {i for indices, _ in clear_motions for i in indices[:-1]}
        trajectory = replace(
            trajectory,
            events=tuple(event.event for event in scenario.events),
            loads=joints.loaded_robots.loads(trajectory.start_time) if joints.loaded_robots else (),
            segments=motion_segments(scenario, starts),
        )
        findings = [*solution.infeasibilities]
        if chosen is not None:
            from knotwork.planning.choosing.chosen_times_findings import chosen_times_findings

            findings += chosen_times_findings(chosen, joints)
            # the solutions were chosen before the times, and the times are only valid for them
            solution = replace(
                chosen.solution, waypoints=waypoints, infeasibilities=solution.infeasibilities
            )
        if clear_motions:
            from knotwork.planning.choosing.chosen_times_findings import clear_motion_findings

            findings += clear_motion_findings(clear_motions, scenario, joints, trajectory)
        report = check(trajectory, scenario, joints=joints, known=findings)
        return Plan(
            scenario,
            joints,
            waypoints,
            trajectory,
            report,
            unsupported_options=interpolator.unsupported,
            solution=solution,
            chosen=chosen,
        )
