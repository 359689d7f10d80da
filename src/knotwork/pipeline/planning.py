"""The whole way from a scenario to a checked trajectory."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from knotwork.errors import InputError
from knotwork.interpolation import PLANNER_SPECS, planner_and_rule
from knotwork.pipeline.avoidance import best_of_sequences
from knotwork.pipeline.execution import ExecutionMixin
from knotwork.pipeline.infeasibility import infeasible
from knotwork.pipeline.plan_files import PlanFiles
from knotwork.pipeline.planner_options import Interpolation, Knots
from knotwork.pipeline.replanning import scenario_from
from knotwork.scenario import FreeTimes, Scenario, load_scenario
from knotwork.scenario.event_reader import found_ways, segments
from knotwork.scenario.joint_space import JointSpace, joint_space
from knotwork.task import Task
from knotwork.task_to_joint import Step, TaskSolution, solve_task
from knotwork.trajectory import Event, JointTrajectory, Segment
from knotwork.verification import Report, check
from knotwork.waypoints import JointWaypoints

if TYPE_CHECKING:
    from knotwork.choosing import ChosenTimes
    from knotwork.timing import Progress
    from knotwork.timing.budget import Budget
    from knotwork.view.page import Page

MOST_SEQUENCES = 12
"""Maximum number of sequences of solutions to plan."""

MOST_TIMED = 4
"""The same where times are chosen anew for each."""


@dataclass(frozen=True, eq=False)
class Plan(ExecutionMixin, PlanFiles):
    """A scenario, its waypoints at the joints, the trajectory through them, and the verdict.

    Attributes:
        scenario: The task.
        space: The joints it moves and their robot.
        joint_waypoints: Joint positions and velocities at the waypoints.
        trajectory: The motion.
        report: Findings of the check.
        left_out: Options of the scenario that a planner given in place of its own does not support.
        solution: Choice of the solutions of the poses.
        chosen: Chosen values of a scenario with free times, which `scenario` then has as numbers;
            `None` if nothing was free.
        sequences: Number of sequences of solutions planned until one collided nowhere, or all.

    >>> made = kw.plan("paper_case")
    >>> made.joint_waypoints.time, made.trajectory.end_time, made.report.ok
    (array([ 0.,  5., 15., 25.]), 25.0, True)
    """

    scenario: Scenario
    space: JointSpace
    joint_waypoints: JointWaypoints
    trajectory: JointTrajectory
    report: Report
    left_out: tuple[str, ...] = ()
    solution: TaskSolution | None = None
    chosen: ChosenTimes | None = None
    sequences: int = 1

    @property
    def events(self) -> tuple[Event, ...]:
        """Switching events, in order of time."""
        return self.trajectory.events

    @property
    def segments(self) -> tuple[Segment, ...]:
        """Parts of the motion, in order of time.

        >>> [(one.name, one.kind) for one in kw.plan("paper_case").segments][:2]
        [('A to B', 'free motion'), ('B to C', 'free motion')]
        """
        return self.trajectory.segments

    def __repr__(self) -> str:
        """The report in short."""
        return str(self.report)

    def _repr_html_(self) -> str:
        return self.report._repr_html_()

    def view(self, compare: Sequence[str] = ()) -> Page:
        """Show the arm making its move, in 3D.

        A notebook shows the page inline; `save` writes it to a file that any browser opens.

        Args:
            compare: Planners whose motions are shown over it, as translucent arms.

        Raises:
            InputError: The scenario has no robot, or another planner can't plan it.
        """
        from knotwork.view.show import view_plan

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
        from knotwork.view.show import scene_of

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
        from knotwork.choosing import with_optimal_knots

        base, ruled = planner_and_rule(planner or scenario.planner)
        if "chosen" not in PLANNER_SPECS[base].supports or "knots" in ruled:
            raise InputError(
                f"{scenario.name}: knots: optimal are those of modified-hermite, which "
                f"{planner or scenario.planner!r} does not take; give one of the two"
            )
        scenario, knots = with_optimal_knots(scenario), None
    if scenario.free is None:
        return best_of_sequences(_Planner(scenario, planner, knots))
    return _with_chosen_times(scenario, scenario.free, planner, knots, budget, progress)


def _with_chosen_times(
    scenario: Scenario,
    free: FreeTimes,
    planner: str | None,
    knots: Knots,
    budget: float | None,
    progress: Callable[[Progress], None] | None,
) -> Plan:
    """Choose what a scenario leaves free, plan it, and check the result; arguments as of `plan`."""
    from knotwork.choosing import with_times_met
    from knotwork.timing.budget import Budget

    names = [one.name for one in scenario.waypoints]
    met = tuple(names[i] for i in free.meets if free.duration[i - 1])
    timed = _TimedPlanner(scenario, free, planner, knots, Budget(seconds=budget), progress, met)
    if not free.meets:
        return best_of_sequences(timed)
    scenario = with_times_met(scenario, lambda one: timed.at(one).chosen_times(None))
    if scenario.free is None:
        return best_of_sequences(_Planner(scenario, planner, knots))
    return best_of_sequences(timed.at(scenario))


class _Planner:
    """Plans a scenario with nothing free; arguments as of `plan`."""

    most = MOST_SEQUENCES

    def __init__(
        self,
        scenario: Scenario,
        planner: str | None,
        knots: Knots,
        chosen: ChosenTimes | None = None,
    ) -> None:
        self.interpolation = Interpolation.of(scenario, planner, knots)
        self.scenario, self.space = self.interpolation.scenario, self.interpolation.space
        self.chosen = chosen

    def solve(self, avoided: Sequence[Step] = ()) -> TaskSolution:
        """Find the best sequence of solutions without some steps."""
        return solve_task(self.scenario, self.space, self.interpolation.knots_along_paths, avoided)

    def plan(self, solution: TaskSolution | None = None) -> Plan:
        """Interpolate a sequence of solutions, by default the best, and check the motion."""
        solution = solution or self.solve()
        scenario, space, chosen = self.scenario, self.space, self.chosen
        waypoints = solution.waypoints
        trajectory = self.interpolation.trajectory(waypoints)
        events = tuple(one.event for one in scenario.events)
        ways = [*found_ways(scenario)] if self.interpolation.options.chosen else []
        parts = segments(scenario, {i for found, _ in ways for i in found[:-1]})
        loads = space.carrying.loads(trajectory.start_time) if space.carrying else ()
        trajectory = replace(trajectory, events=events, loads=loads, segments=parts)
        known = [infeasible(one, scenario.units) for one in solution.infeasibilities]
        if chosen is not None:
            from knotwork.choosing.findings import findings

            known += findings(chosen, space)
            # the solutions were chosen before the times were, which hold them fast
            solution = replace(
                chosen.solution, waypoints=waypoints, infeasibilities=solution.infeasibilities
            )
        if ways:
            from knotwork.choosing.ways_found import ways_found

            known += ways_found(ways, scenario, space, trajectory)
        report = check(trajectory, scenario, space=space, known=known)
        left_out = self.interpolation.left_out
        return Plan(scenario, space, waypoints, trajectory, report, left_out, solution, chosen)

    def late(self) -> bool:
        """Whether the time budget has ended: there is none."""
        return False

    def with_ways(self, ends: Sequence[int]) -> None:
        """No planner: `way: clear` needs a time that is chosen."""


@dataclass(frozen=True, eq=False)
class _TimedPlanner:
    """Chooses what a scenario leaves free, then plans it; arguments as of `plan`.

    Attributes:
        time: Shares the budget between all that is planned.
        met: Waypoints in frames that move, by name, whose times are chosen first.
    """

    scenario: Scenario
    free: FreeTimes
    planner: str | None
    knots: Knots
    time: Budget
    progress: Callable[[Progress], None] | None
    met: tuple[str, ...]
    most: ClassVar[int] = MOST_TIMED

    def at(self, scenario: Scenario) -> _TimedPlanner:
        """The planner of another scenario within the same budget."""
        return replace(self, scenario=scenario, free=scenario.free or self.free)

    def solve(self, avoided: Sequence[Step]) -> TaskSolution:
        """Find the best sequence of solutions without some steps."""
        from knotwork.choosing.task import knots_of

        return solve_task(
            self.scenario, joint_space(self.scenario), knots_of(self.scenario), avoided
        )

    def chosen_times(self, solution: TaskSolution | None) -> ChosenTimes:
        """Choose times for a sequence of solutions, by default the best."""
        from knotwork.choosing import choose_times

        left = None if self.time.seconds is None else max(self.time.left(), 1e-3)
        return choose_times(
            self.scenario, self.free, budget=left, progress=self.progress, solution=solution
        )

    def plan(self, solution: TaskSolution | None) -> Plan:
        """Choose times for a sequence of solutions, by default the best, and plan with them."""
        from knotwork.timing import Progress

        chosen = replace(self.chosen_times(solution), met=self.met)
        if self.progress is not None:
            took = self.time.now() - self.time.begun
            steps = sum(one.iterations for one in chosen.segments)
            self.progress(Progress(steps, took, 1.0, chosen.duration, "check"))
        return _Planner(chosen.scenario, self.planner, self.knots, chosen).plan()

    def late(self) -> bool:
        """Whether the time budget has ended."""
        return self.time.left() <= 0.0

    def with_ways(self, ends: Sequence[int]) -> _TimedPlanner:
        """The planner of the task with `way: clear` at some waypoints."""
        from knotwork.choosing.task import with_ways

        return self.at(with_ways(self.scenario, ends))
