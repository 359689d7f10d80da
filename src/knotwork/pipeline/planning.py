"""The whole way from a scenario to a checked trajectory."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from numpy.typing import ArrayLike

from knotwork.errors import InputError
from knotwork.interpolation import PLANNER_SPECS, BalancedKnots, get_planner, planner_and_rule
from knotwork.pipeline.avoidance import MOST_TIMED, best_of_sequences, first_with_ways
from knotwork.pipeline.plan_files import PlanFiles
from knotwork.pipeline.planner_options import (
    knots_along_paths,
    option_context,
    planner_options,
    supported_options,
)
from knotwork.pipeline.replanning import scenario_from
from knotwork.pipeline.under_way import UnderWay
from knotwork.scenario import FreeTimes, Scenario, load_scenario
from knotwork.scenario.events import found_ways, segments
from knotwork.scenario.joint_space import JointSpace, joint_space
from knotwork.task import Task
from knotwork.task_to_joint import Step, TaskSolution, solve_task
from knotwork.trajectory import Event, JointTrajectory, Segment
from knotwork.verification import Finding, Report, check
from knotwork.waypoints import JointWaypoints

if TYPE_CHECKING:
    from knotwork.choosing import ChosenTimes
    from knotwork.timing import Progress
    from knotwork.view.page import Page

Knots: TypeAlias = str | float | ArrayLike | BalancedKnots | None


@dataclass(frozen=True, eq=False)
class Plan(UnderWay, PlanFiles):
    """A scenario, its waypoints at the joints, the trajectory through them, and the verdict.

    Attributes:
        scenario: What was asked for.
        space: The joints it moves and their robot.
        joint_waypoints: Joint positions and velocities at the waypoints.
        trajectory: The motion.
        report: What the check found.
        left_out: Options of the scenario that a planner given in place of its own does not support.
        solution: How the solutions of the poses were chosen.
        chosen: What was chosen of a scenario with free times; `scenario` then has numbers in place
            of them. `None` where nothing was free.
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
        """What is switched on the way, in order of time."""
        return self.trajectory.events

    @property
    def segments(self) -> tuple[Segment, ...]:
        """What the motion consists of, in order of time.

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
        budget: Where times are free: the time after which the best motion so far is taken [s]; by
            default as long as it takes.
        progress: Where times are free: called as the solver goes on.

    Returns:
        The plan. Its `report.ok` says whether it does what was asked: a limit that is broken is
        no error here.

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
        return best_of_sequences(*_planned(scenario, planner, knots))
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
    from knotwork.choosing import choose_times, with_times_met
    from knotwork.choosing.task import knots_of, with_ways
    from knotwork.timing import Progress
    from knotwork.timing.budget import Watch

    time, names = Watch(budget=budget), [one.name for one in scenario.waypoints]
    met = tuple(names[i] for i in free.meets if free.duration[i - 1])

    def left() -> float | None:
        return None if budget is None else max(time.left(), 1e-3)

    if free.meets:

        def at_expected_times(one: Scenario) -> ChosenTimes:
            return choose_times(one, one.free or free, budget=left(), progress=progress)

        scenario = with_times_met(scenario, at_expected_times)
        if scenario.free is None:
            return best_of_sequences(*_planned(scenario, planner, knots))
        free = scenario.free

    def timed(solution: TaskSolution | None, seconds: float | None) -> Plan:
        chosen = choose_times(scenario, free, budget=seconds, progress=progress, solution=solution)
        chosen = replace(chosen, met=met)
        if progress is not None:
            took, steps = time.now() - time.begun, sum(one.iterations for one in chosen.segments)
            progress(Progress(steps, took, 1.0, chosen.duration, "check"))
        return _planned(chosen.scenario, planner, knots, chosen)[0]

    def another(solution: TaskSolution) -> Plan | None:
        return timed(solution, left()) if time.left() > 0.0 else None

    def solve(avoided: Sequence[Step]) -> TaskSolution:
        return solve_task(scenario, joint_space(scenario), knots_of(scenario), avoided)

    def around(ends: list[int]) -> Plan:
        clear = with_ways(scenario, ends)
        return _with_chosen_times(clear, clear.free or free, planner, knots, left(), progress)

    def begun(solution: TaskSolution | None) -> Plan:
        return timed(solution, budget if solution is None else left())

    first = first_with_ways(begun, solve, MOST_TIMED)
    return best_of_sequences(first, solve, another, MOST_TIMED, around)


def _planned(
    scenario: Scenario,
    planner: str | None,
    knots: Knots,
    chosen: ChosenTimes | None = None,
) -> tuple[Plan, Callable[[Sequence[Step]], TaskSolution], Callable[[TaskSolution], Plan]]:
    """Plan a scenario with nothing free: the plan, what finds other solutions, what plans them."""
    own_planner = scenario.planner
    if planner is None:
        with scenario.error_context("planner"):
            get_planner(own_planner)
    else:
        scenario = replace(scenario, planner=planner)
    interpolate = get_planner(scenario.planner)
    space = joint_space(scenario)
    options = planner_options(scenario, space)
    left_out: tuple[str, ...] = ()
    if scenario.planner != own_planner:
        options, left_out = supported_options(options, own_planner, scenario.planner)
    if knots is not None:
        if "knots" in planner_and_rule(scenario.planner)[1]:
            raise InputError(
                f"{scenario.name}: knots: given together with those of {scenario.planner!r}; give "
                "one of the two"
            )
        placed: Any = knots.c if isinstance(knots, BalancedKnots) else knots
        scenario = replace(scenario, knots=placed)
        options = replace(options, knots=planner_options(scenario, space).knots, chosen=None)
    arguments = {"planner": planner, "knots": knots}
    replaced = {name for name, value in arguments.items() if value is not None}

    def made(solution: TaskSolution) -> Plan:
        waypoints = solution.waypoints
        with option_context(scenario, waypoints, replaced):
            trajectory = interpolate(waypoints, options)
        events = tuple(one.event for one in scenario.events)
        ways = [*found_ways(scenario)] if options.chosen else []
        parts = segments(scenario, {i for found, _ in ways for i in found[:-1]})
        loads = space.carrying.loads(trajectory.start_time) if space.carrying else ()
        trajectory = replace(trajectory, events=events, loads=loads, segments=parts)
        known: list[Finding] = []
        if chosen is not None:
            from knotwork.choosing.findings import findings

            known += findings(chosen, space)
            # the solutions were chosen before the times were, which hold them fast
            solution = replace(chosen.solution, waypoints=waypoints, feasible=solution.feasible)
        if ways:
            from knotwork.choosing.ways_found import ways_found

            known += ways_found(ways, scenario, space, trajectory)
        report = check(trajectory, scenario, space=space, known=known)
        return Plan(scenario, space, waypoints, trajectory, report, left_out, solution, chosen)

    def solve(avoided: Sequence[Step]) -> TaskSolution:
        return solve_task(scenario, space, knots_along_paths(scenario.planner, options), avoided)

    return made(solve(())), solve, made
