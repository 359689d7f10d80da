"""Plans of a scenario with a given sequence of IK solutions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

from knotwork.errors.plain_text import to_one_line
from knotwork.planning.planned_motion import Plan
from knotwork.planning.planner_options import Interpolation
from knotwork.planning.task_to_joint import (
    Infeasibility,
    SequenceStep,
    TaskSolution,
    solve_task,
)
from knotwork.planning.timing.timed_motion import Budget
from knotwork.task.scenario import Scenario
from knotwork.task.scenario.event_reader import find_clear_motions, segments
from knotwork.units import Units, readable
from knotwork.verification import Finding, check

if TYPE_CHECKING:
    from knotwork.planning.choosing import ChosenTimes

FEASIBILITY = "Feasibility"
"""Group of findings that hold for every motion through the joint waypoints."""

FIXED_SEQUENCES, TIMED_SEQUENCES = 12, 4
"""Maximum number of sequences of solutions to plan: with given times, with times to be chosen."""


@dataclass(frozen=True, eq=False)
class ScenarioPlanner:
    """Plans a scenario with one sequence of IK solutions, after its unknowns are chosen.

    Attributes:
        scenario, planner: As of `plan`.
        budget: Budget and progress of all plans together.
        fixed_arrivals: Waypoints in moving frames, by name, whose times were chosen first.
    """

    scenario: Scenario
    planner: str | None
    budget: Budget = field(default_factory=Budget)
    fixed_arrivals: tuple[str, ...] = ()

    @property
    def max_sequences(self) -> int:
        """Maximum number of sequences to plan."""
        return FIXED_SEQUENCES if self.scenario.unknowns is None else TIMED_SEQUENCES

    @property
    def is_late(self) -> bool:
        """Whether the time budget has ended."""
        return self.budget.is_over

    @cached_property
    def _interpolation(self) -> Interpolation:
        return Interpolation.read(self.scenario, self.planner)

    def solve(self, avoided: Sequence[SequenceStep] = ()) -> TaskSolution:
        """Find the best sequence of solutions without some steps."""
        chosen = self._interpolation
        return solve_task(chosen.scenario, chosen.space, chosen.knots_along_paths, avoided)

    def choose_times(self, solution: TaskSolution | None = None) -> ChosenTimes:
        """Choose times for a sequence of solutions, by default the best."""
        from knotwork.planning.choosing import choose_times

        return choose_times(self.scenario, self.budget, solution)

    def plan(self, solution: TaskSolution | None = None) -> Plan:
        """Plan a sequence of solutions, by default the best, and check the motion."""
        if self.scenario.unknowns is None:
            return self._interpolate(solution or self.solve())
        chosen = replace(self.choose_times(solution), fixed_arrivals=self.fixed_arrivals)
        self.budget.solved = self.budget.work
        self.budget.step(0, chosen.duration, "check")
        fixed = replace(self, scenario=chosen.scenario)
        return fixed._interpolate(fixed.solve(), chosen)

    def _interpolate(self, solution: TaskSolution, chosen: ChosenTimes | None = None) -> Plan:
        """Interpolate a sequence of solutions, and check the motion."""
        interpolation, waypoints = self._interpolation, solution.waypoints
        scenario, space = interpolation.scenario, interpolation.space
        trajectory = interpolation.trajectory(waypoints)
        clear_motions = [*find_clear_motions(scenario)] if interpolation.options.chosen else []
        starts = {i for indices, _ in clear_motions for i in indices[:-1]}
        trajectory = replace(
            trajectory,
            events=tuple(event.event for event in scenario.events),
            loads=space.carrying.loads(trajectory.start_time) if space.carrying else (),
            segments=segments(scenario, starts),
        )
        known = [_velocity_finding(limit, scenario.units) for limit in solution.infeasibilities]
        if chosen is not None:
            from knotwork.planning.choosing.chosen_times_findings import chosen_times_findings

            known += chosen_times_findings(chosen, space)
            # the solutions were chosen before the times, and the times are only valid for them
            solution = replace(
                chosen.solution, waypoints=waypoints, infeasibilities=solution.infeasibilities
            )
        if clear_motions:
            from knotwork.planning.choosing.chosen_times_findings import clear_motion_findings

            known += clear_motion_findings(clear_motions, scenario, space, trajectory)
        report = check(trajectory, scenario, space=space, known=known)
        return Plan(
            scenario,
            space,
            waypoints,
            trajectory,
            report,
            unsupported_options=interpolation.unsupported,
            solution=solution,
            chosen=chosen,
        )


def _velocity_finding(limit: Infeasibility, units: Units) -> Finding:
    """The finding for a velocity limit that is exceeded whatever solutions are chosen."""
    needed = units.shown(limit.velocity, limit.unit)[0]
    allowed = units.text(limit.limit, limit.unit, ".4g")
    if limit.until:
        why, place = "on average", f"from {limit.waypoint!r} to {limit.until!r}"
        duration = limit.end - limit.start
        remedy = (
            f"{duration / limit.fraction:.4g} s or more is sufficient for the mean, and they have "
            f"{duration:.4g} s"
        )
    else:
        why, place = "for the tool's velocity", f"at {limit.waypoint!r}"
        remedy = f"{limit.fraction:.3g} of that velocity is feasible"
    return Finding(
        group=FEASIBILITY,
        subject="waypoint",
        name=limit.waypoint,
        quantity="joint_velocity_needed",
        verdict="failed",
        fact=f"{place} {limit.joint} needs {units.text(limit.velocity, limit.unit, '.4g')} {why}, "
        f"and its limit is {allowed}",
        value=limit.velocity,
        limit=limit.limit,
        margin=limit.limit - limit.velocity,
        unit=limit.unit,
        time=None if limit.until else limit.start,
        label=f"{to_one_line(limit.joint)} needs {readable(needed)} of {allowed} {why}",
        remedy=remedy,
        interval=(limit.start, limit.end) if limit.until else None,
    )
